//! What a ball reaches from outside, and the largest that spans the region.
