//! How figures are drawn: once, onto SVG and PNG alike, with a font that comes along.

use std::path::{Path, PathBuf};
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;

use crate::error::Error;

pub(crate) type Area<B> = DrawingArea<B, Shift>;
pub(crate) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// The font of all texts; a browser that does not have it takes its own.
pub(crate) const FONT: &str = "sans-serif";

/// Colours that people with colour-blindness can tell apart (Okabe and Ito, 2008).
pub(crate) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(86, 180, 233),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
];

/// A figure that can be drawn onto anything.
pub(crate) trait Figure {
    /// Width and height in pixels.
    fn size(&self) -> (u32, u32);
    /// Draws it.
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B>;
}

/// Writes a figure as `stem.svg` and `stem.png`.
pub(crate) fn save(figure: &impl Figure, folder: &Path, stem: &str) -> Result<[PathBuf; 2], Error> {
    use_own_font();
    let paths = ["svg", "png"].map(|ending| folder.join(format!("{stem}.{ending}")));
    draw(figure, SVGBackend::new(&paths[0], figure.size()), &paths[0])?;
    draw(figure, BitMapBackend::new(&paths[1], figure.size()), &paths[1])?;
    Ok(paths)
}

/// Writes a figure into one file, by its ending.
pub(crate) fn save_as(figure: &impl Figure, path: &Path) -> Result<(), Error> {
    use_own_font();
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "svg" => draw(figure, SVGBackend::new(path, figure.size()), path),
        "png" => draw(figure, BitMapBackend::new(path, figure.size()), path),
        _ => {
            let reason = "a figure's name ends in .svg or .png".to_owned();
            Err(Error::Write { path: path.to_owned(), reason })
        }
    }
}

fn draw<B: DrawingBackend>(figure: &impl Figure, backend: B, path: &Path) -> Result<(), Error> {
    let area = backend.into_drawing_area();
    let drawn = area.fill(&WHITE).and_then(|()| figure.draw(&area)).and_then(|()| area.present());
    drawn.map_err(|e| Error::Write { path: path.to_owned(), reason: e.to_string() })
}

/// Lets texts be measured and drawn on machines without fonts.
fn use_own_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        for style in [FontStyle::Normal, FontStyle::Bold] {
            let registered = register_font(FONT, style, epaint_default_fonts::UBUNTU_LIGHT);
            debug_assert!(registered.is_ok(), "the font that comes along is a font");
        }
    });
}
