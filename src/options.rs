//! Every option, with its default, unit, range and advice.

use crate::error::Error;
use crate::message::message;
use crate::number::text;

/// What to estimate, and how. `Options::default()` is right for most scans.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Options {
    /// How a normal is found. Default: [`Method::Bilinear`].
    pub method: Method,
    /// Size of the cubes. Default: [`Cell::Auto`]. The baselines have no cubes.
    pub cell: Cell,
    /// How many nearest points the baselines look at, at least 3; if there are fewer, all. Default: 16 for
    /// [`Method::Knn`], the point itself among them; 8 others for [`Method::Egg`].
    pub k: Option<u32>,
    /// How signs are chosen. Default: [`Orient::None`].
    pub orient: Orient,
    /// Whether to return the surface variation of every point too ([`crate::Estimate::curvature`]). Default: no.
    pub curvature: bool,
    /// Whether to return which surface every point belongs to ([`crate::Estimate::components`]), with
    /// [`Orient::Consistent`] or [`Orient::Outward`]. Default: no.
    pub components: bool,
}

/// Fewer points determine no plane.
const LEAST_NEIGHBOURS: u32 = 3;

/// How a normal is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// Surfaces on a grid of cubes; with cubes of one size bilinear interpolation between their planes, the paper's method.
    #[default]
    Bilinear,
    /// Principal component analysis of the k nearest points, the point itself among them: the paper's ENN. The exact
    /// reference: eight to sixty times as slow as cubes of one size.
    Knn,
    /// A quadratic surface through the point's neighbours in the elliptic Gabriel graph, of which the k nearest points
    /// are considered: the paper's EGG. For clean data of uneven density; noise goes straight into its normals.
    Egg,
}

/// Edge of the cubes.
///
/// Small cubes follow detail and edges, large ones average noise away. What counts is the number of points in an
/// occupied cube: about 4 suit clean scans, 15 to 60 noisy ones.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Cell {
    /// Every place takes the size that its noise and its detail allow: nothing to choose (docs/adaptive.md). Stray points
    /// change next to nothing.
    #[default]
    Auto,
    /// Multiples of the paper's L (Eq. 1), 0.1 to 100; the paper advises 1.0 to 1.5. L is defined by the bounding box:
    /// a single stray point enlarges it.
    Scale(f64),
    /// Cube edge in the units of the input, above 0.
    Size(f64),
}

/// How the sign of a normal is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Orient {
    /// Deterministic, and nothing more: `x + 2y + 4z >= 0` for every normal.
    #[default]
    None,
    /// One sign for each connected surface: outwards if it is closed, else towards what stands before it; if nothing does, as
    /// what it touches, or away from its middle, and if it is flat `x + 2y + 4z >= 0` for its mean normal. If all was seen from
    /// one place, everything faces it, and surfaces face a few scanners that stood amid them, where densities tell these. For
    /// anything; [`crate::Report::components`] tells how sure it is. With [`Method::Bilinear`] and [`Cell::Auto`] also the
    /// lines of some normals change, because no sign of them would be right: in noise, where surfaces face apart within it, to
    /// a mean of normals with their signs; and without any noise, where a face is too narrow for a surface, to that of the
    /// plane that the points lie on.
    Consistent,
    /// One sign for each connected surface, away from its inside, also if it is not closed, and to nothing that stands before it,
    /// nor to a scanner: for objects, also with holes.
    Outward,
    /// Towards a position, in the coordinates of the input: for what was scanned from there.
    Viewpoint([f64; 3]),
    /// Towards a direction of any length: for terrain.
    Up([f64; 3]),
}

impl Orient {
    /// Whether signs depend on where the points are.
    pub(crate) fn needs_positions(self) -> bool {
        match self {
            Self::None | Self::Up(_) => false,
            Self::Consistent | Self::Outward | Self::Viewpoint(_) => true,
        }
    }

    /// Whether each surface gets one sign.
    pub(crate) fn is_of_surfaces(self) -> bool {
        matches!(self, Self::Consistent | Self::Outward)
    }
}

impl Options {
    /// Refuses values out of range, and without the feature `full` what this build does not offer.
    ///
    /// # Errors
    /// [`Error::Input`] with what came and what was wanted, [`Error::Unsupported`] for what this build does not offer.
    pub fn validate(&self) -> Result<(), Error> {
        if !cfg!(feature = "full") {
            // Its default, in less code than it takes to compare all that there could be.
            let Self {
                method: Method::Bilinear,
                cell: Cell::Auto,
                k: None,
                orient: Orient::None,
                curvature: false,
                components: false,
            } = self
            else {
                return Err(Error::Unsupported("this build has the default options only".into()));
            };
            return Ok(());
        }
        match self.cell {
            Cell::Auto => {}
            Cell::Scale(scale) if (0.1..=100.0).contains(&scale) => {}
            Cell::Scale(scale) => {
                return Err(Error::Input(message!["cell.scale is ", text(scale), "; wanted a number from 0.1 to 100"]));
            }
            Cell::Size(size) if size > 0.0 && size.is_finite() => {}
            Cell::Size(size) => {
                return Err(Error::Input(message!["cell.size is ", text(size), "; wanted a finite number above 0"]));
            }
        }
        if let Some(k) = self.k
            && k < LEAST_NEIGHBOURS
        {
            return Err(Error::Input(message!["k is ", k, "; wanted a whole number of at least ", LEAST_NEIGHBOURS]));
        }
        let vector = |name: &str, [x, y, z]: [f64; 3], wanted: &str| {
            let [x, y, z] = [x, y, z].map(text);
            Err(Error::Input(message!["orient.", name, " is ", x, ", ", y, ", ", z, "; wanted ", wanted]))
        };
        if self.components && !self.orient.is_of_surfaces() {
            return Err(Error::Input(
                "components are those of orient 'consistent' or 'outward'; wanted one of them".into(),
            ));
        }
        match self.orient {
            Orient::Viewpoint(viewpoint) if !viewpoint.iter().all(|x| x.is_finite()) => {
                vector("viewpoint", viewpoint, "three finite numbers")
            }
            Orient::Up(up) if !up.iter().all(|x| x.is_finite()) || up == [0.0; 3] => {
                vector("up", up, "three finite numbers, not all 0")
            }
            _ => Ok(()),
        }
    }
}
