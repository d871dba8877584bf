//! Pieces against floods node by node, and sets whose pieces are known.
