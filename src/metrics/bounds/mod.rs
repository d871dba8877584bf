//! What certainly is solid, and what may be.
