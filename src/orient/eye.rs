//! From where a cloud may have been seen, a place beside it or a direction, and what of it faces there.

use super::ball::Ball;
use super::patches::{Patches, signed};
use super::signs::Signs;
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::{filled, reserve};
use glam::{DVec3, Vec3};

/// What errors call the memory of all this.
const WHAT: &str = "the view";

/// How near an eye may be: one over its distance from the middle, in radii. What was scanned from several sides faces away from
/// nearer places, too.
const NEAREST: f64 = 0.35;

/// How much is learnt of what faces away.
const RATE: f64 = 2.0;

/// A component of which more than this share faces away, either way, was scanned all round, and is left alone.
const MIXED: f64 = 0.25;

/// From where a cloud is seen, in homogeneous coordinates: far off it is a direction, and beyond that, with a nearness of less
/// than zero, a place on the other side, which all that faces this direction faces away from.
#[derive(Clone, Copy)]
pub(super) struct Eye {
    /// The direction from the middle of the cloud's ball, of length 1.
    pub towards: DVec3,
    /// One over the distance from there, in radii, which are what nearly all of the cloud lies within, in edges.
    nearness: f64,
    radius: f64,
}

impl Eye {
    /// One far off, if there is a direction.
    pub fn far(ball: &Ball, towards: DVec3) -> Option<Self> {
        towards.try_normalize().map(|towards| Self { towards, nearness: 0.0, radius: ball.reach() })
    }

    /// The direction to it from a place, which is counted from the middle, of whatever length.
    pub fn direction(&self, place: Vec3) -> Vec3 {
        self.directions()(place)
    }

    /// The same, for many places.
    #[inline(always)]
    fn directions(&self) -> impl Fn(Vec3) -> Vec3 + use<> {
        let (towards, nearness) = (self.towards.as_vec3(), (self.nearness / self.radius) as f32);
        move |place| towards - nearness * place
    }

    /// The cosine of the angle at which a surface is seen; less than zero from behind.
    pub fn cosine(&self, normal: Vec3, place: Vec3) -> f32 {
        normal.dot(self.direction(place).normalize())
    }

    /// Whether it is as near as it may be, and more would face it from nearer still.
    pub fn is_too_near(&self) -> bool {
        self.nearness.abs() >= NEAREST
    }

    /// The same as near as may be, from `least` to `most` times the largest nearness.
    pub fn within(self, [least, most]: [f64; 2]) -> Self {
        Self { nearness: self.nearness.clamp(NEAREST * least, NEAREST * most), ..self }
    }

    /// The eye that more faces, as a perceptron learns (Rosenblatt, 1958): towards what still faces away. Nearness is one more
    /// coordinate, kept within `range`.
    pub fn taught(&self, missed: &Missed, range: [f64; 2]) -> Option<Self> {
        let share = RATE / missed.all.max(1.0);
        let towards = self.towards + share * missed.normal;
        let length = towards.length();
        let nearness = (self.nearness - share * missed.flux / self.radius) / length;
        (length > 0.0).then(|| Self { towards: towards / length, nearness, ..*self }.within(range))
    }
}

/// A patch as it was signed.
#[derive(Clone, Copy)]
pub(super) struct Signed {
    /// From the middle of the cloud's ball, in edges.
    pub place: Vec3,
    pub normal: Vec3,
    pub points: u32,
    pub component: u32,
}

impl Signed {
    /// The same, or facing the other way.
    pub fn turned(self, is_flipped: bool) -> Self {
        Self { normal: signed(is_flipped, self.normal), ..self }
    }
}

/// All patches.
pub(super) fn each<'a>(
    ball: &'a Ball,
    grid: &'a Grid,
    patches: &'a Patches,
    signs: &'a Signs,
) -> impl Iterator<Item = Signed> + 'a {
    let signs = signs.flipped.iter().zip(&signs.component);
    patches.places(grid).zip(signs).map(|((patch, place), (&is_flipped, &component))| Signed {
        place: (place - ball.middle).as_vec3(),
        normal: signed(is_flipped, patch.normal),
        points: patch.points,
        component,
    })
}

/// Some patches, all over the cloud, `most` of them at the most.
pub(super) fn some(
    most: usize,
    (ball, grid, patches): (&Ball, &Grid, &Patches),
    signs: &Signs,
) -> Result<Vec<Signed>, Error> {
    let count = patches.all.len();
    let stride = count.div_ceil(most).max(1);
    let mut some = Vec::new();
    reserve(&mut some, count.div_ceil(stride), WHAT)?;
    some.extend(each(ball, grid, patches, signs).step_by(stride));
    Ok(some)
}

/// Sums over what faces away from an eye.
#[derive(Default)]
pub(super) struct Missed {
    pub points: f64,
    /// All points, also those that face it.
    pub all: f64,
    /// Of the normals.
    normal: DVec3,
    /// Of their products with where they are.
    flux: f64,
}

impl Missed {
    /// Adds the points of a patch.
    pub fn add(&mut self, &Signed { place, normal, points, .. }: &Signed) {
        let points = f64::from(points);
        self.points += points;
        self.normal += points * normal.as_dvec3();
        self.flux += points * f64::from(normal.dot(place));
    }

    /// The share that faces away.
    pub fn share(&self) -> f64 {
        self.points / self.all.max(1.0)
    }
}

/// Surfaces turned to an eye.
pub(super) struct Turned {
    /// For each component how it faces there; `None` for what was not seen from one side.
    pub components: Vec<Option<Seen>>,
    /// The share of those that were not.
    pub mixed: f64,
    /// What still faces away of the others.
    pub missed: Missed,
    /// The sum of all their normals.
    pub normal: DVec3,
}

/// A component that faces an eye.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// Once it is flipped.
    pub is_flipped: bool,
    /// But for this share.
    pub away: f64,
}

impl Turned {
    /// How components are to be turned so that as much as can be of some patches faces an eye. Two passes over these.
    pub fn to<I: Iterator<Item = Signed>>(
        eye: &Eye,
        patches: impl Fn() -> I,
        components: usize,
    ) -> Result<Self, Error> {
        let direction = eye.directions();
        // A patch with what of its points faces away: all or none. Without a jump, because nothing foretells which.
        let missed_of = |patch: &Signed| {
            let is_away = patch.normal.dot(direction(patch.place)) < 0.0;
            Signed { points: patch.points * u32::from(is_away), ..*patch }
        };
        // For each its points, and those of them that face away.
        let mut counts = filled((0u32, 0u32), components, WHAT)?;
        for patch in patches() {
            let (all, away) = &mut counts[patch.component as usize];
            *all += patch.points;
            *away += missed_of(&patch).points;
        }
        let mut components = Vec::new();
        reserve(&mut components, counts.len(), WHAT)?;
        components.extend(counts.into_iter().map(|(all, away)| {
            let (all, away) = (f64::from(all), f64::from(away));
            let (is_flipped, away) = (2.0 * away > all, away.min(all - away) / all);
            (away <= MIXED).then_some(Seen { is_flipped, away })
        }));
        let (mut all, mut missed, mut sum) = (0.0, Missed::default(), DVec3::ZERO);
        for patch in patches() {
            let points = f64::from(patch.points);
            all += points;
            let Some(Seen { is_flipped, .. }) = components[patch.component as usize] else { continue };
            let patch = patch.turned(is_flipped);
            missed.all += points;
            sum += points * patch.normal.as_dvec3();
            missed.add(&missed_of(&patch));
        }
        Ok(Self { components, mixed: 1.0 - missed.all / all, missed, normal: sum })
    }

    /// Whether a component was turned.
    pub fn is_flipped(&self, component: usize) -> bool {
        self.components[component].is_some_and(|seen| seen.is_flipped)
    }

    /// The share that does not fit.
    pub fn unfit(&self) -> f64 {
        self.missed.share().max(self.mixed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a floor two radii wide, and of four walls on its rim that face its middle, or away from it.
    fn tray(inwards: bool) -> Vec<Signed> {
        let steps = || (-4..=4).map(|i| 0.25 * i as f32);
        let square = || steps().flat_map(|a| steps().map(move |b| (a, b)));
        let floor = square().map(|(x, y)| (Vec3::new(x, y, 0.0), Vec3::Z));
        let walls = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y].into_iter().flat_map(|side| {
            let along = side.cross(Vec3::Z);
            square().map(move |(a, b)| (side + a * along + 0.2 * (1.0 + b) * Vec3::Z, signed(inwards, side)))
        });
        floor.chain(walls).map(|(place, normal)| Signed { place, normal, points: 8, component: 0 }).collect()
    }

    fn taught(tray: &[Signed], range: [f64; 2]) -> (Eye, f64) {
        let mut eye = Eye { towards: DVec3::new(0.1, -0.05, 1.0).normalize(), nearness: 0.0, radius: 1.0 };
        let mut missed = Missed::default();
        for _ in 0..30 {
            missed = Missed { all: 8.0 * tray.len() as f64, ..Missed::default() };
            let away = tray.iter().filter(|patch| eye.cosine(patch.normal, patch.place) < 0.02);
            away.for_each(|patch| missed.add(patch));
            eye = eye.taught(&missed, range).unwrap();
        }
        (eye, missed.share())
    }

    #[test]
    fn walls_that_face_each_other_are_seen_from_between_them() {
        let (eye, missed) = taught(&tray(true), [0.0, 1.0]);
        assert!(missed == 0.0 && eye.nearness > 0.02, "{missed}, {}", eye.nearness);
        // Not from afar, nor from the other end.
        for range in [[0.0, 0.0], [-1.0, 0.0]] {
            assert!(taught(&tray(true), range).1 > 0.1);
        }
    }

    #[test]
    fn walls_that_face_apart_all_face_away_from_a_place_behind() {
        let (eye, missed) = taught(&tray(false), [-1.0, 1.0]);
        assert!(missed == 0.0 && eye.nearness < -0.02, "{missed}, {}", eye.nearness);
    }

    /// What is seen all round is part of no view.
    #[test]
    fn components_are_turned_or_left() {
        let far = Eye { towards: DVec3::Z, nearness: 0.0, radius: 1.0 };
        let below = |patch: &Signed| Signed { normal: -patch.normal, component: 1, ..*patch };
        let half =
            |(i, patch): (usize, &Signed)| Signed { normal: signed(i % 2 == 0, patch.normal), component: 2, ..*patch };
        let floor: Vec<Signed> = tray(true).into_iter().take(81).collect();
        let all: Vec<Signed> =
            floor.iter().copied().chain(floor.iter().map(below)).chain(floor.iter().enumerate().map(half)).collect();
        let turned = Turned::to(&far, || all.iter().copied(), 3).unwrap();
        let told: Vec<Option<bool>> = turned.components.iter().map(|seen| seen.map(|seen| seen.is_flipped)).collect();
        assert_eq!(told, [Some(false), Some(true), None]);
        assert!((turned.mixed - 1.0 / 3.0).abs() < 1e-12 && turned.missed.share() == 0.0);
        assert_eq!(turned.normal, DVec3::new(0.0, 0.0, 2.0 * 8.0 * 81.0));
    }
}
