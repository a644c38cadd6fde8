//! The texts of errors, from pieces: a browser loads a KiB less without the library's formatting.

/// What goes into a text.
pub(crate) trait Piece {
    fn add_to(&self, text: &mut String);
}

impl Piece for str {
    #[cold]
    #[inline(never)]
    fn add_to(&self, text: &mut String) {
        text.push_str(self);
    }
}

impl Piece for u64 {
    #[cold]
    #[inline(never)]
    fn add_to(&self, text: &mut String) {
        if *self > 9 {
            (self / 10).add_to(text);
        }
        let digit = (self % 10) as usize;
        "0123456789"[digit..=digit].add_to(text);
    }
}

impl Piece for u32 {
    fn add_to(&self, text: &mut String) {
        u64::from(*self).add_to(text);
    }
}

impl Piece for usize {
    fn add_to(&self, text: &mut String) {
        (*self as u64).add_to(text);
    }
}

impl Piece for String {
    fn add_to(&self, text: &mut String) {
        self.as_str().add_to(text);
    }
}

impl<T: Piece + ?Sized> Piece for &T {
    fn add_to(&self, text: &mut String) {
        (**self).add_to(text);
    }
}

/// A text of pieces, one after the other: texts and whole numbers.
macro_rules! message {
    ($($piece:expr),+ $(,)?) => {{
        let mut text = String::new();
        $($crate::message::Piece::add_to(&$piece, &mut text);)+
        text
    }};
}
pub(crate) use message;

#[cfg(test)]
mod tests {
    #[test]
    fn messages_are_their_pieces() {
        let name = String::from("y");
        assert_eq!(message!["x", 0_u64, &name, 10_u32, ' '.to_string(), u64::MAX], "x0y10 18446744073709551615");
        assert_eq!(message![usize::MAX, (-1.5f64).to_string()], format!("{}-1.5", usize::MAX));
    }
}
