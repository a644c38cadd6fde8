//! Two smooth sheets close to each other, as where round bodies touch, or on both sides of an edge, told apart by how exactly
//! points lie on them.
//!
//! A surface that is fitted to both lies between them. Where the cloud has no noise, each point lies on one of two quadratic
//! surfaces: at first one is fitted to the points on either side of that surface, then to those that are nearer to it than to
//! the other, until they lie on it.

use super::around::Near;
use super::level::Level;
use super::samples::{Sample, Window};
use super::surface::Quadric;
use glam::Vec3;

/// Neighbourhoods of more points are left to the surfaces.
const ROOM: usize = u128::BITS as usize;

/// A sheet has so many points: four more than a quadratic surface takes.
const LEAST: u32 = 10;

/// Points lie on their sheet to 0.0017 edges, squared and on average.
const ON: f32 = 3e-6;

/// From each time to the next no more than this share of the noise is left, or these are not two sheets.
const LEFT: f32 = 0.5;

/// The sheets near a cube, against its centre, in edges.
pub(super) struct Sheets {
    window: Window,
    places: Vec<Vec3>,
    /// A bit for each place that is on the second one.
    second: u128,
    both: [Quadric; 2],
}

impl Sheets {
    pub fn new() -> Self {
        Self { window: Window::new(), places: Vec::new(), second: 0, both: [Quadric::NONE; 2] }
    }

    /// Finds the sheets that the points of some cubes near the one with bit `bit` of a brick lie on, if these are two: on either
    /// side of the surface through all.
    #[inline(never)]
    pub fn find(&mut self, level: &Level, bit: u32, near: &[Near]) -> bool {
        self.places.clear();
        for (shift, points) in level.points_near(bit, near) {
            if self.places.len() + points.len() > ROOM {
                return false;
            }
            self.places.extend(points.iter().map(|p| p.local + shift));
        }
        self.window.clear();
        self.places.iter().for_each(|&place| self.window.add(&[Sample::point(place)], Vec3::ZERO, 1.0));
        let between = self.window.fit();
        let mut noise = between.noise;
        self.part(|_, place| between.quadric.at(place).1 > 0.0);
        while let Some(left) = self.fit(LEFT * noise) {
            if left <= ON {
                return true;
            }
            noise = left;
            self.part(Self::is_on_second);
        }
        false
    }

    /// Tells anew which places are on the second sheet.
    fn part(&mut self, is_on_second: impl Fn(&Self, Vec3) -> bool) {
        let bit = |(i, &place): (usize, &Vec3)| u128::from(is_on_second(self, place)) << i;
        self.second = self.places.iter().enumerate().map(bit).sum();
    }

    /// Fits each sheet to its places. Answers the larger noise of the two, if that is no more than `most`.
    fn fit(&mut self, most: f32) -> Option<f32> {
        let on_second = self.second.count_ones();
        if on_second.min(self.places.len() as u32 - on_second) < LEAST {
            return None;
        }
        let mut noise = 0.0f32;
        for (number, sheet) in (0..).zip(&mut self.both) {
            self.window.clear();
            for (i, &place) in self.places.iter().enumerate() {
                if self.second >> i & 1 == number {
                    self.window.add(&[Sample::point(place)], Vec3::ZERO, 1.0);
                }
            }
            let surface = self.window.fit();
            if !surface.is_some() || surface.noise > most {
                return None;
            }
            noise = noise.max(surface.noise);
            *sheet = surface.quadric;
        }
        Some(noise)
    }

    /// Whether a point is nearer to the second sheet than to the first.
    fn is_on_second(&self, place: Vec3) -> bool {
        let [first, second] = self.both.each_ref().map(|sheet| {
            let (slope, height) = sheet.at(place);
            height * height / slope.length_squared()
        });
        second < first
    }

    /// The direction of the normal of the sheet that a point lies on.
    #[inline(never)]
    pub fn direction(&self, place: Vec3) -> Vec3 {
        self.both[usize::from(self.is_on_second(place))].at(place).0
    }
}
