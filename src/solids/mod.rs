//! Model solids.
