//! Surface by orientation: what is cut by the region, what overhangs.
