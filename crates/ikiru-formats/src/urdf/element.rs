//! The small elements of URDF and their numbers: origin, axis, limit, mimic, geometry.

use std::borrow::Cow;

use glam::{DQuat, DVec3};
use ikiru_rig::{Range, ShapeKind};

use crate::error::ErrorKind;
use crate::urdf::problem::UrdfProblem;
use crate::urdf::trouble::Trouble;
use crate::urdf::xml::Element;
use crate::warning::short;

/// The link or joint that an element belongs to.
#[derive(Clone, Copy)]
pub(crate) struct Owner<'a> {
    /// `link` or `joint`.
    pub(crate) what: &'static str,
    pub(crate) name: &'a str,
}

impl std::fmt::Display for Owner<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} '{}'", self.what, short(self.name))
    }
}

impl<'a> Owner<'a> {
    /// A problem of the link or joint as a whole.
    pub(crate) fn fault(self, at: usize, kind: impl Into<ErrorKind>) -> Trouble {
        Trouble::new(at, self.to_string(), kind)
    }

    fn of<'t>(self, element: &Element<'t>) -> Reading<'a, 't> {
        Reading { owner: self, element: *element }
    }
}

/// An element while its attributes are read.
struct Reading<'a, 't> {
    owner: Owner<'a>,
    element: Element<'t>,
}

impl<'t> Reading<'_, 't> {
    fn attributes<const N: usize>(
        &self,
        names: [&'static str; N],
    ) -> Result<[Option<Cow<'t, str>>; N], Trouble> {
        self.element.attributes(&|| self.label(), names)
    }

    fn label(&self) -> String {
        format!("<{}> of {}", short(self.element.tag), self.owner)
    }

    fn fault(&self, kind: impl Into<ErrorKind>) -> Trouble {
        Trouble::new(self.element.at, self.label(), kind)
    }

    /// So many numbers, separated by spaces.
    fn numbers<const N: usize>(&self, name: &'static str, value: &str) -> Result<[f64; N], Trouble> {
        let refuse = |expected| self.fault(UrdfProblem::Numbers { name, found: short(value), expected });
        let expected = if N == 1 { "a number" } else { "three numbers separated by spaces" };
        let mut numbers = [0.0; N];
        let mut words = value.split_ascii_whitespace();
        for number in &mut numbers {
            let parsed = words.next().and_then(|word| word.parse().ok());
            *number = parsed.filter(|n: &f64| !n.is_nan()).ok_or_else(|| refuse(expected))?;
        }
        if words.next().is_some() {
            return Err(refuse(expected));
        }
        if numbers.iter().any(|n| n.abs() > 1e100) {
            return Err(self.fault(ErrorKind::Magnitude { what: name, found: numbers.to_vec() }));
        }
        Ok(numbers)
    }

    fn number_or(&self, name: &'static str, value: Option<&str>, default: f64) -> Result<f64, Trouble> {
        Ok(value.map(|value| self.numbers::<1>(name, value)).transpose()?.map_or(default, |[n]| n))
    }

    /// A size: not negative.
    fn size<const N: usize>(&self, name: &'static str, value: Option<&str>) -> Result<[f64; N], Trouble> {
        let expected = if N == 1 { "a length in metres" } else { "three lengths in metres" };
        let value = value.ok_or_else(|| self.fault(UrdfProblem::NoAttribute { name, expected }))?;
        let numbers = self.numbers(name, value)?;
        if numbers.iter().any(|n| *n < 0.0) {
            return Err(self.fault(UrdfProblem::Numbers { name, found: short(value), expected }));
        }
        Ok(numbers)
    }
}

/// Where a frame lies in another.
#[derive(Clone, Copy)]
pub(crate) struct Origin {
    pub(crate) rotation: DQuat,
    pub(crate) translation: DVec3,
}

impl Origin {
    pub(crate) const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };
}

/// `<origin xyz rpy>`: both default to zeros; rpy turns about the fixed x, then y, then z axis.
pub(crate) fn origin(owner: Owner<'_>, element: &Element<'_>) -> Result<Origin, Trouble> {
    let reading = owner.of(element);
    let [xyz, rpy] = reading.attributes(["xyz", "rpy"])?;
    let three = |name, value: Option<Cow<'_, str>>| match value {
        Some(value) => reading.numbers::<3>(name, &value),
        None => Ok([0.0; 3]),
    };
    let translation = DVec3::from(three("xyz", xyz)?);
    let [roll, pitch, yaw] = three("rpy", rpy)?;
    let rotation = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch) * DQuat::from_rotation_x(roll);
    Ok(Origin { rotation: rotation.normalize(), translation })
}

/// `<axis xyz>` at unit length; the default is x.
pub(crate) fn axis(owner: Owner<'_>, element: &Element<'_>) -> Result<DVec3, Trouble> {
    let reading = owner.of(element);
    let [Some(xyz)] = reading.attributes(["xyz"])? else { return Ok(DVec3::X) };
    let axis = DVec3::from(reading.numbers::<3>("xyz", &xyz)?);
    // Scaled first, so that tiny numbers do not vanish on the way.
    let largest = axis.abs().max_element();
    (axis / largest).try_normalize().ok_or_else(|| reading.fault(UrdfProblem::ZeroAxis))
}

/// `<limit lower upper>`, `None` where neither is given; one alone leaves the other at its default, 0.
pub(crate) fn limit(owner: Owner<'_>, element: &Element<'_>) -> Result<Option<Range>, Trouble> {
    let reading = owner.of(element);
    let [lower, upper] = reading.attributes(["lower", "upper"])?;
    if lower.is_none() && upper.is_none() {
        return Ok(None);
    }
    // An end may be infinite, which is no limit.
    let end = |name, value: Option<&str>| match value.and_then(|v| v.trim().parse::<f64>().ok()) {
        Some(end) if end.is_infinite() => Ok(end),
        _ => reading.number_or(name, value, 0.0),
    };
    let (min, max) = (end("lower", lower.as_deref())?, end("upper", upper.as_deref())?);
    if min > max || min == f64::INFINITY || max == f64::NEG_INFINITY {
        return Err(reading.fault(UrdfProblem::Limits { lower: min, upper: max }));
    }
    Ok(Some(Range::new(min, max)))
}

/// `<mass value>`: kilograms.
pub(crate) fn mass(owner: Owner<'_>, element: &Element<'_>) -> Result<f64, Trouble> {
    let reading = owner.of(element);
    let expected = "a mass in kilograms, at least 0";
    let [value] = reading.attributes(["value"])?;
    let missing = UrdfProblem::NoAttribute { name: "value", expected };
    let value = value.ok_or_else(|| reading.fault(missing))?;
    let [kg] = reading.numbers("value", &value)?;
    if kg < 0.0 {
        return Err(reading.fault(UrdfProblem::Numbers { name: "value", found: short(&value), expected }));
    }
    Ok(kg)
}

/// Whom a joint follows, and how.
pub(crate) struct MimicElement<'t> {
    pub(crate) leader: Cow<'t, str>,
    pub(crate) multiplier: f64,
    pub(crate) offset: f64,
    pub(crate) at: usize,
}

/// `<mimic joint multiplier offset>`.
pub(crate) fn mimic<'t>(owner: Owner<'_>, element: &Element<'t>) -> Result<MimicElement<'t>, Trouble> {
    let reading = owner.of(element);
    let [leader, multiplier, offset] = reading.attributes(["joint", "multiplier", "offset"])?;
    let missing = UrdfProblem::NoAttribute { name: "joint", expected: "the name of the joint to follow" };
    Ok(MimicElement {
        leader: leader.ok_or_else(|| reading.fault(missing))?,
        multiplier: reading.number_or("multiplier", multiplier.as_deref(), 1.0)?,
        offset: reading.number_or("offset", offset.as_deref(), 0.0)?,
        at: element.at,
    })
}

/// `<parent link>` and `<child link>`.
pub(crate) fn link<'t>(owner: Owner<'_>, element: &Element<'t>) -> Result<Cow<'t, str>, Trouble> {
    let reading = owner.of(element);
    let [link] = reading.attributes(["link"])?;
    let missing = UrdfProblem::NoAttribute { name: "link", expected: "the name of a link" };
    link.ok_or_else(|| reading.fault(missing))
}

/// A solid inside of `<geometry>`; `None` for a mesh and what else there may be.
pub(crate) fn shape(owner: Owner<'_>, element: &Element<'_>) -> Result<Option<ShapeKind>, Trouble> {
    let reading = owner.of(element);
    let round = || -> Result<(f64, f64), Trouble> {
        let [radius, length] = reading.attributes(["radius", "length"])?;
        let ([radius], [length]) =
            (reading.size("radius", radius.as_deref())?, reading.size("length", length.as_deref())?);
        Ok((radius, length))
    };
    Ok(Some(match element.tag {
        "sphere" => {
            let [radius] = reading.attributes(["radius"])?;
            let [radius] = reading.size("radius", radius.as_deref())?;
            ShapeKind::Sphere { radius }
        }
        "cylinder" => round().map(|(radius, length)| ShapeKind::Cylinder { radius, length })?,
        "capsule" => round().map(|(radius, length)| ShapeKind::Capsule { radius, length })?,
        "box" => {
            let [size] = reading.attributes(["size"])?;
            ShapeKind::Box { size: reading.size("size", size.as_deref())? }
        }
        _ => return Ok(None),
    }))
}
