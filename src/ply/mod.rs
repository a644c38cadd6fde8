//! Reading and writing PLY files.
