//! Numbers out of bytes: exact, and quick for the way people write them.

/// Powers of ten that a double holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];
/// More digits than this may overflow 64 bits.
const MAX_DIGITS: usize = 19;

/// What `scan` found: the value and how many bytes it took.
type Found<T> = Option<(T, usize)>;

/// Reads a finite number at the front of `bytes`, up to a blank or the end; `None` when there is none.
///
/// A decimal with a significand up to 2⁵³ and a power of ten up to 10²² needs one correctly rounded operation on two exact
/// doubles, so the quick way gives the same bits as the standard library (Clinger 1990); everything else goes there.
pub(super) fn float(bytes: &[u8]) -> Found<f64> {
    match quick_float(bytes) {
        Some(found) => Some(found),
        None => careful_float(bytes),
    }
}

#[inline]
fn quick_float(bytes: &[u8]) -> Found<f64> {
    let mut at = 0;
    let negative = bytes.first() == Some(&b'-');
    at += usize::from(negative);
    let mut significand = 0u64;
    let whole = digits(bytes, &mut at, &mut significand);
    let mut fraction = 0;
    if bytes.get(at) == Some(&b'.') {
        at += 1;
        fraction = digits(bytes, &mut at, &mut significand);
    }
    let count = whole + fraction;
    if count == 0 || count > MAX_DIGITS || significand > 1 << 53 || fraction >= EXACT_POWERS.len() || !ends(bytes, at) {
        return None;
    }
    let magnitude = significand as f64 / EXACT_POWERS[fraction];
    Some((if negative { -magnitude } else { magnitude }, at))
}

#[inline]
fn digits(bytes: &[u8], at: &mut usize, significand: &mut u64) -> usize {
    let start = *at;
    while let Some(digit) = bytes.get(*at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        *significand = significand.wrapping_mul(10).wrapping_add(u64::from(digit));
        *at += 1;
    }
    *at - start
}

fn careful_float(bytes: &[u8]) -> Found<f64> {
    let token = token(bytes);
    let value: f64 = std::str::from_utf8(token).ok()?.parse().ok()?;
    value.is_finite().then_some((value, token.len()))
}

/// Reads a whole number without a sign, up to a blank or the end.
#[inline]
pub(super) fn integer(bytes: &[u8]) -> Found<u64> {
    let mut at = 0;
    let mut value = 0;
    let count = digits(bytes, &mut at, &mut value);
    if count == 0 || !ends(bytes, at) {
        return None;
    }
    if count > MAX_DIGITS {
        // Twenty digits may still fit; the standard library knows.
        value = std::str::from_utf8(&bytes[..at]).ok()?.parse().ok()?;
    }
    Some((value, at))
}

/// The bytes up to the next blank or line end.
pub(super) fn token(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().position(|b| is_blank(*b)).unwrap_or(bytes.len());
    &bytes[..end]
}

#[inline]
fn ends(bytes: &[u8], at: usize) -> bool {
    bytes.get(at).is_none_or(|b| is_blank(*b))
}

#[inline]
fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | b'\n')
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn hard_numbers_match_the_standard_library_bit_for_bit() {
        for text in [
            "0",
            "-0",
            "1.",
            ".5",
            "-.5",
            "44.721360",
            "9007199254740993",
            "123456789012345678901234567890",
            "1e-7",
            "2.5E3",
            "0.1",
            "3.141592653589793",
            "1e22",
            "4.9e-324",
            "0.000000000000000000000000000001",
            "1.7976931348623157e308",
            "+7.25",
        ] {
            let (value, length) = float(text.as_bytes()).unwrap();
            assert_eq!(value.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
            assert_eq!(length, text.len());
        }
    }

    #[test]
    fn what_is_no_finite_number_is_refused() {
        for text in ["", "-", ".", "x", "1x", "nan", "inf", "-inf", "1e999", "1.2.3", "--1", "0x10", "1e"] {
            assert_eq!(float(text.as_bytes()), None, "{text}");
        }
        for text in ["", "-1", "1.0", "18446744073709551616", "a"] {
            assert_eq!(integer(text.as_bytes()), None, "{text}");
        }
        assert_eq!(integer(b"18446744073709551615 7"), Some((u64::MAX, 20)));
    }

    proptest! {
        #[test]
        fn every_double_survives_printing_and_reading(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            for text in [format!("{value:e}"), format!("{value:.6}"), format!("{value}")] {
                let (read, _) = float(text.as_bytes()).unwrap();
                prop_assert_eq!(read.to_bits(), text.parse::<f64>().unwrap().to_bits());
            }
        }
    }
}
