//! Whole numbers of any length.

use std::cmp::Ordering;

/// Words of 32 bits, the lowest first; the highest is not zero.
#[derive(Clone)]
pub(super) struct Big(Vec<u32>);

impl Big {
    pub fn new(value: u64) -> Self {
        let mut big = Self(vec![value as u32, (value >> 32) as u32]);
        big.trim();
        big
    }

    fn trim(&mut self) {
        while self.0.last() == Some(&0) {
            self.0.pop();
        }
    }

    /// Times `factor`, which is not zero, plus `more`.
    #[inline(never)]
    pub fn times(&mut self, factor: u32, more: u32) {
        let mut carry = u64::from(more);
        for word in &mut self.0 {
            carry += u64::from(*word) * u64::from(factor);
            *word = carry as u32;
            carry >>= 32;
        }
        if carry > 0 {
            self.0.push(carry as u32);
        }
    }

    /// Times `base` to the power `exponent`.
    pub fn times_power(&mut self, base: u32, exponent: i64) {
        for _ in 0..exponent {
            self.times(base, 0);
        }
    }

    /// Less a number that is not greater.
    #[inline(never)]
    pub fn subtract(&mut self, other: &Self) {
        let mut borrow = false;
        for (place, word) in self.0.iter_mut().enumerate() {
            let less = other.0.get(place).copied().unwrap_or_default();
            let (rest, first) = word.overflowing_sub(less);
            let (rest, second) = rest.overflowing_sub(u32::from(borrow));
            *word = rest;
            borrow = first || second;
        }
        self.trim();
    }

    #[inline(never)]
    pub fn compare(&self, other: &Self) -> Ordering {
        let mut order = self.0.len().cmp(&other.0.len());
        let mut place = self.0.len();
        while order.is_eq() && place > 0 {
            place -= 1;
            order = self.0[place].cmp(&other.0[place]);
        }
        order
    }

    pub fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    /// The bits up to the highest that is set.
    pub fn bits(&self) -> i64 {
        32 * self.0.len() as i64 - self.0.last().map_or(0, |word| i64::from(word.leading_zeros()))
    }
}
