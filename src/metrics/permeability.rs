//! Estimates of permeability.
//!
//! Kozeny and Carman model the pores as winding tubes of the same surface (P. C. Carman, *Transactions of the Institution of
//! Chemical Engineers* 15, 1937): k = φ³/(K·S_V²), φ being the porosity and S_V the surface *per total volume*, BS/TV. (Where
//! the surface is taken per volume of solid, S₀ = S_V/(1 − φ), the same reads φ³/(K·S₀²(1 − φ)²).) K combines the shape of the
//! tubes' section and their tortuosity: 2 for straight round tubes, 3 for straight slits, about 5 for beds of grains
//! ([`KOZENY`]). It is an estimate: no flow is calculated, and dead-end pores count as others do.

/// Kozeny's constant as Carman found it on beds of grains.
pub const KOZENY: f64 = 5.0;

/// Returns the permeability k in square world units, from a porosity, the surface per total volume S_V in 1 / world unit and
/// Kozeny's constant K. `None` where it is undefined: no surface, a porosity beyond 0 to 1, a constant not above 0.
pub fn kozeny_carman(porosity: f64, surface_per_volume: f64, constant: f64) -> Option<f64> {
    let has_meaning = (0.0..=1.0).contains(&porosity) && surface_per_volume > 0.0 && constant > 0.0;
    has_meaning.then(|| porosity.powi(3) / (constant * surface_per_volume * surface_per_volume))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn straight_tubes_and_slits_have_the_permeability_of_poiseuille() {
        // A round tube of radius r in a cell of section 1: φ r²/8.
        let r: f64 = 0.3;
        let (porosity, surface) = (PI * r * r, 2.0 * PI * r);
        assert!((kozeny_carman(porosity, surface, 2.0).unwrap() / (porosity * r * r / 8.0) - 1.0).abs() < 1e-12);
        // A slit of width w in a cell of section 1: φ w²/12.
        let w: f64 = 0.2;
        assert!((kozeny_carman(w, 2.0, 3.0).unwrap() / (w * w * w / 12.0) - 1.0).abs() < 1e-12);
        assert!((kozeny_carman(0.5, 2.0, KOZENY).unwrap() - 0.125 / 20.0).abs() < 1e-15);
    }

    #[test]
    fn permeability_is_none_for_impossible_inputs() {
        assert_eq!(kozeny_carman(0.5, 0.0, KOZENY), None);
        assert_eq!(kozeny_carman(f64::NAN, 1.0, KOZENY), None);
        assert_eq!(kozeny_carman(1.1, 1.0, KOZENY), None);
        assert_eq!(kozeny_carman(0.5, f64::NAN, KOZENY), None);
        assert_eq!(kozeny_carman(0.5, 1.0, 0.0), None);
    }
}
