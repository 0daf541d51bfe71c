//! A URDF document: its links and joints, each element checked by itself.

use std::borrow::Cow;

use glam::DVec3;
use ikiru_rig::{Range, RigBuilder, ShapeKind};

use crate::error::ErrorKind;
use crate::urdf::element::{self, MimicElement, Origin, Owner};
use crate::urdf::kind::Kind;
use crate::urdf::problem::UrdfProblem;
use crate::urdf::trouble::{Text, Trouble};
use crate::urdf::warning::UrdfWarning;
use crate::urdf::xml::{Element, Scanner, Step};
use crate::warning::{Warning, Warnings, short};

/// A link: all that kinematics needs of it is its name.
pub(crate) struct Link<'t> {
    pub(crate) name: Cow<'t, str>,
    pub(crate) at: usize,
}

/// A joint.
pub(crate) struct JointElement<'t> {
    pub(crate) name: Cow<'t, str>,
    pub(crate) at: usize,
    pub(crate) kind: Kind,
    pub(crate) parent: Cow<'t, str>,
    pub(crate) child: Cow<'t, str>,
    pub(crate) origin: Origin,
    /// Of unit length.
    pub(crate) axis: DVec3,
    /// Unlimited where the type has none.
    pub(crate) range: Range,
    pub(crate) mimic: Option<MimicElement<'t>>,
}

/// A collision shape of a link.
pub(crate) struct Shape {
    /// Position of the link.
    pub(crate) link: usize,
    pub(crate) origin: Origin,
    pub(crate) kind: ShapeKind,
}

/// How heavy a link is, and where: massless ones have none.
pub(crate) struct Inertial {
    /// Position of the link.
    pub(crate) link: usize,
    pub(crate) kg: f64,
    /// In the link's frame.
    pub(crate) center: DVec3,
}

/// Everything that is read.
pub(crate) struct Document<'t> {
    pub(crate) text: Text<'t>,
    pub(crate) links: Vec<Link<'t>>,
    pub(crate) joints: Vec<JointElement<'t>>,
    pub(crate) shapes: Vec<Shape>,
    pub(crate) inertials: Vec<Inertial>,
}

impl<'t> Document<'t> {
    /// Reads `<robot>` and skips what kinematics does not need.
    pub(crate) fn parse(text: &'t str, warnings: &mut Warnings) -> Result<Self, Trouble> {
        let mut scanner = Scanner::new(text);
        let mut document = Self {
            text: scanner.text,
            links: Vec::new(),
            joints: Vec::new(),
            shapes: Vec::new(),
            inertials: Vec::new(),
        };
        if let Step::Open(root) = scanner.next()?
            && root.tag != "robot"
        {
            let found = short(root.tag);
            return Err(Trouble::new(root.at, "", UrdfProblem::RootElement { found }));
        }
        scanner.children(|scanner, element| match element.tag {
            "link" => document.link(scanner, &element, warnings),
            "joint" => document.joint(scanner, &element, warnings),
            _ => Ok(()),
        })?;
        // Whatever comes behind the root element is refused there.
        scanner.next()?;
        Ok(document)
    }

    fn link(
        &mut self,
        scanner: &mut Scanner<'t>,
        element: &Element<'t>,
        warnings: &mut Warnings,
    ) -> Result<(), Trouble> {
        let text = self.text;
        let [name] = element.attributes(&|| "<link>".to_owned(), ["name"])?;
        let name = named(element, name)?;
        not_too_many(element, self.links.len())?;
        let owner = Owner { what: "link", name: &name };
        let link = self.links.len();
        let mut has_inertial = false;
        scanner.children(|scanner, child| {
            match child.tag {
                // What is wrong with a solid is no reason to refuse the kinematics.
                "collision" => match collision(scanner, owner)? {
                    Ok(None) => {}
                    Ok(Some((origin, kind))) => self.shapes.push(Shape { link, origin, kind }),
                    Err(trouble) if is_xacro(&trouble) => return Err(trouble),
                    Err(trouble) => warnings.push(|| {
                        let (link, line) = (short(owner.name), text.line(child.at));
                        let reason = short(&trouble.kind().to_string());
                        Warning::Urdf(UrdfWarning::CollisionDropped { link, line, reason })
                    }),
                },
                "inertial" if std::mem::replace(&mut has_inertial, true) => {
                    warnings.push(|| repeated(&child, owner, text));
                }
                "inertial" => {
                    let (kg, center) = inertial(scanner, owner, text, warnings)?;
                    if kg > 0.0 {
                        self.inertials.push(Inertial { link, kg, center });
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
        self.links.push(Link { name, at: element.at });
        Ok(())
    }

    fn joint(
        &mut self,
        scanner: &mut Scanner<'t>,
        element: &Element<'t>,
        warnings: &mut Warnings,
    ) -> Result<(), Trouble> {
        let text = self.text;
        let [name, kind] = element.attributes(&|| "<joint>".to_owned(), ["name", "type"])?;
        let name = named(element, name)?;
        not_too_many(element, self.joints.len())?;
        let owner = Owner { what: "joint", name: &name };
        let fault = |problem: UrdfProblem| owner.fault(element.at, problem);
        let missing = UrdfProblem::NoAttribute { name: "type", expected: Kind::NAMES };
        let kind = kind.ok_or_else(|| fault(missing))?;
        let found = Kind::ALL.into_iter().find(|known| known.name() == kind);
        let unknown = || UrdfProblem::JointType { found: short(&kind), expected: Kind::NAMES };
        let kind = found.ok_or_else(|| fault(unknown()))?;

        let mut parts = Parts::default();
        scanner.children(|_, child| parts.take(&child, kind, owner, text, warnings))?;
        let link = |name, expected| fault(UrdfProblem::NoElementOf { name, expected });
        let parent = parts.parent.ok_or_else(|| link("parent", "the link that the joint hangs from"))?;
        let child = parts.child.ok_or_else(|| link("child", "the link that the joint moves"))?;
        let range = match parts.limit {
            _ if !kind.has_limits() => Range::UNLIMITED,
            None => return Err(fault(UrdfProblem::NoLimit { kind: kind.name() })),
            Some(Some(range)) => range,
            // Whom it follows says how far it goes.
            Some(None) if parts.mimic.is_some() => Range::UNLIMITED,
            Some(None) => {
                warnings.push(|| Warning::Urdf(UrdfWarning::NoRange { joint: short(&name) }));
                Range::new(0.0, 0.0)
            }
        };
        self.joints.push(JointElement {
            at: element.at,
            kind,
            parent,
            child,
            origin: parts.origin.unwrap_or(Origin::IDENTITY),
            axis: parts.axis.unwrap_or(DVec3::X),
            range,
            mimic: parts.mimic,
            name,
        });
        Ok(())
    }
}

/// The elements inside of a joint, each one once.
#[derive(Default)]
struct Parts<'t> {
    parent: Option<Cow<'t, str>>,
    child: Option<Cow<'t, str>>,
    origin: Option<Origin>,
    axis: Option<DVec3>,
    limit: Option<Option<Range>>,
    mimic: Option<MimicElement<'t>>,
}

impl<'t> Parts<'t> {
    fn take(
        &mut self,
        child: &Element<'t>,
        kind: Kind,
        owner: Owner<'_>,
        text: Text<'_>,
        warnings: &mut Warnings,
    ) -> Result<(), Trouble> {
        // What a joint of its type does not have is not even read: fixed joints often carry leftovers.
        match child.tag {
            "axis" if !kind.has_axis() => {}
            "limit" if !kind.has_limits() => {}
            "mimic" if !kind.is_scalar() => warnings.push(|| {
                let joint = short(owner.name);
                Warning::Urdf(UrdfWarning::MimicIgnored { joint, kind: kind.name() })
            }),
            "parent" if self.parent.is_none() => self.parent = Some(element::link(owner, child)?),
            "child" if self.child.is_none() => self.child = Some(element::link(owner, child)?),
            "origin" if self.origin.is_none() => self.origin = Some(element::origin(owner, child)?),
            "axis" if self.axis.is_none() => self.axis = Some(element::axis(owner, child)?),
            "limit" if self.limit.is_none() => self.limit = Some(element::limit(owner, child)?),
            "mimic" if self.mimic.is_none() => self.mimic = Some(element::mimic(owner, child)?),
            "parent" | "child" | "origin" | "axis" | "limit" | "mimic" => {
                warnings.push(|| repeated(child, owner, text));
            }
            _ => {}
        }
        Ok(())
    }
}

/// `<inertial>`: kilograms, none where there is no `<mass>`, and where their centre is.
fn inertial(
    scanner: &mut Scanner<'_>,
    owner: Owner<'_>,
    text: Text<'_>,
    warnings: &mut Warnings,
) -> Result<(f64, DVec3), Trouble> {
    let (mut kg, mut center) = (None, None);
    scanner.children(|_, child| {
        match child.tag {
            "mass" if kg.is_none() => kg = Some(element::mass(owner, &child)?),
            "origin" if center.is_none() => center = Some(element::origin(owner, &child)?.translation),
            "mass" | "origin" => warnings.push(|| repeated(&child, owner, text)),
            _ => {}
        }
        Ok(())
    })?;
    Ok((kg.unwrap_or_default(), center.unwrap_or_default()))
}

/// An element that stands where it did before.
fn repeated(element: &Element<'_>, owner: Owner<'_>, text: Text<'_>) -> Warning {
    Warning::Urdf(UrdfWarning::Repeated {
        element: element.tag.to_owned(),
        line: text.line(element.at),
        owner: owner.to_string(),
    })
}

/// A solid and where it lies.
type Placed = Option<(Origin, ShapeKind)>;

/// `<collision>`: its origin and solid. What is wrong inside comes apart from what is wrong with the file.
fn collision(scanner: &mut Scanner<'_>, owner: Owner<'_>) -> Result<Result<Placed, Trouble>, Trouble> {
    let (mut origin, mut kind) = (Ok(Origin::IDENTITY), Ok(None));
    scanner.children(|scanner, child| {
        match child.tag {
            "origin" => origin = element::origin(owner, &child),
            "geometry" => {
                scanner.children(|_, solid| {
                    if let Ok(None) = kind {
                        kind = element::shape(owner, &solid);
                    }
                    Ok(())
                })?;
            }
            _ => {}
        }
        Ok(())
    })?;
    Ok(kind.and_then(|kind| kind.map(|kind| Ok((origin?, kind))).transpose()))
}

fn is_xacro(trouble: &Trouble) -> bool {
    matches!(trouble.kind(), ErrorKind::Urdf(UrdfProblem::Xacro { .. }))
}

/// The name of a link or joint.
fn named<'t>(element: &Element<'t>, name: Option<Cow<'t, str>>) -> Result<Cow<'t, str>, Trouble> {
    let expected = "a unique name";
    let problem = match name {
        Some(name) if !name.trim().is_empty() => return Ok(name),
        Some(_) => UrdfProblem::EmptyName { name: "name", expected },
        None => UrdfProblem::NoAttribute { name: "name", expected },
    };
    Err(Trouble::new(element.at, format!("<{}>", element.tag), problem))
}

fn not_too_many(element: &Element<'_>, count: usize) -> Result<(), Trouble> {
    let most = RigBuilder::MOST_JOINTS;
    if count < most {
        return Ok(());
    }
    Err(Trouble::new(element.at, format!("<{}>", element.tag), ErrorKind::TooMany { most }))
}
