//! The C header in single precision: the same text with `float` for `double`, but for what turns times into times.

/// Functions of `<math.h>` that have a form of their own for a float.
const FUNCTIONS: [&str; 30] = [
    "acos",
    "asin",
    "atan",
    "atan2",
    "ceil",
    "copysign",
    "cos",
    "cosh",
    "exp",
    "expm1",
    "fabs",
    "floor",
    "fmax",
    "fmin",
    "fmod",
    "hypot",
    "log",
    "log10",
    "log1p",
    "log2",
    "pow",
    "remainder",
    "round",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "trunc",
    "cbrt",
];
/// The tolerance of an iteration in double precision, and what single precision can reach.
const TOLERANCE: [&str; 2] = ["1e-13", "1e-7"];

/// The header with floats. Functions that take a time, and the one that calls them, stay: a float of seconds since a long drive began would
/// have steps of a tenth of a millisecond.
pub fn single(header: &str) -> String {
    let end = "\n}\n";
    let parts: Vec<String> = header
        .split_inclusive(end)
        .map(|part| {
            let is_of_times = part.contains("(double t)\n{") || part.contains("int64_t truerate_valid_t_ns(int axis");
            if is_of_times { part.to_owned() } else { floats(&part.replace(TOLERANCE[0], TOLERANCE[1])) }
        })
        .collect();
    parts.concat()
}

/// Types, constants and functions of one part; comments stay.
fn floats(code: &str) -> String {
    let mut out = String::with_capacity(code.len());
    let mut rest = code;
    while let Some(first) = rest.chars().next() {
        let taken = match first {
            '/' if rest.starts_with("/*") => rest.find("*/").map_or(rest.len(), |at| at + 2),
            // A preprocessor's line names no number.
            '#' => rest.find('\n').unwrap_or(rest.len()),
            c if c.is_ascii_alphabetic() || c == '_' => {
                let word: &str =
                    &rest[..rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len())];
                let is_called = rest[word.len()..].starts_with('(');
                out.push_str(if word == "double" { "float" } else { word });
                if is_called && FUNCTIONS.contains(&word) {
                    out.push('f');
                }
                rest = &rest[word.len()..];
                continue;
            }
            c if c.is_ascii_digit() => {
                let number = number(rest);
                out.push_str(number);
                if number.contains(['.', 'e']) {
                    out.push('f');
                }
                rest = &rest[number.len()..];
                continue;
            }
            c => c.len_utf8(),
        };
        out.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    out
}

/// The number that stands in front: digits, a point, an exponent.
fn number(text: &str) -> &str {
    let bytes = text.as_bytes();
    let mut end = 0;
    while end < bytes.len() {
        let is_sign = matches!(bytes[end], b'+' | b'-') && end > 0 && matches!(bytes[end - 1], b'e' | b'E');
        if !(bytes[end].is_ascii_digit() || matches!(bytes[end], b'.' | b'e' | b'E') || is_sign) {
            break;
        }
        end += 1;
    }
    &text[..end]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_types_and_functions_become_those_of_a_float_and_times_stay() {
        let code = "/* 1.5 double */\nstatic inline double f(double x)\n{\n    return 2.5e-3 * fabs(x) + x2 / 16 - 1e4;\n}\n\
                    static inline double z0_delay(double t)\n{\n    return t - 0.012;\n}\n";
        assert_eq!(
            single(code),
            "/* 1.5 double */\nstatic inline float f(float x)\n{\n    return 2.5e-3f * fabsf(x) + x2 / 16 - 1e4f;\n}\n\
             static inline double z0_delay(double t)\n{\n    return t - 0.012;\n}\n"
        );
    }
}
