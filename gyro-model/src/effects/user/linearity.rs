//! Which parameters are coefficients: those in which the whole expression is homogeneous of degree one.

use super::expression::{Expression, Operation};

/// How an expression depends on a set of variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Degree {
    /// Not at all.
    Zero,
    /// Proportional.
    One,
    /// In any other way.
    Other,
}

/// The largest set of the variables `0..count` in which the expression is proportional: `true` for those in it. Of
/// equally large sets the one with the earlier variables. All `false` where there is no such set.
pub(super) fn coefficients(expression: &Expression<Option<usize>>, count: usize) -> Vec<bool> {
    let used = expression.variables().flatten().fold(0_u32, |used, k| used | 1 << k);
    let sets = (1_u32..1 << count).filter(|set| set & !used == 0);
    let proportional = sets.filter(|set| degree(expression, |v| v.is_some_and(|k| set >> k & 1 == 1)) == Degree::One);
    let best = proportional.max_by_key(|set| (set.count_ones(), set.reverse_bits())).unwrap_or(0);
    (0..count).map(|k| best >> k & 1 == 1).collect()
}

/// Of the whole expression in the variables that `of` chooses.
fn degree<V: Copy>(expression: &Expression<V>, of: impl Fn(V) -> bool) -> Degree {
    use Degree::{One, Other, Zero};
    let mut stack: Vec<Degree> = Vec::new();
    for operation in &expression.program {
        let arguments = stack.split_off(stack.len() - operation.taken());
        stack.push(match (operation, arguments.as_slice()) {
            (Operation::Variable(v), _) => {
                if of(*v) {
                    One
                } else {
                    Zero
                }
            }
            (Operation::Negate, &[a]) => a,
            (Operation::Add | Operation::Subtract, &[a, b]) if a == b => a,
            (Operation::Multiply, &([One, Zero] | [Zero, One])) | (Operation::Divide, &[One, Zero]) => One,
            (_, arguments) if arguments.iter().all(|a| *a == Zero) => Zero,
            _ => Other,
        });
    }
    stack.pop().unwrap_or(Zero)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> String {
        let names = ["a", "b", "c"];
        let expression = Expression::parse(text, |name| Ok(names.iter().position(|n| *n == name))).unwrap();
        let chosen = coefficients(&expression, 3);
        names.iter().zip(chosen).filter(|(_, chosen)| *chosen).map(|(name, _)| *name).collect()
    }

    #[test]
    fn coefficients_are_what_the_expression_is_proportional_to_together() {
        assert_eq!(of("a * sin(angle) * temp"), "a");
        assert_eq!(of("a * sin(c * t) + b * cos(c * t)"), "ab");
        assert_eq!(of("-(a + b * temp) / (1 + c) * rate^2"), "ab");
        assert_eq!(of("a * b * c"), "a");
        assert_eq!(of("b * exp(-t / a)"), "b");
        assert_eq!(of("a * temp + 1"), "");
        assert_eq!(of("sin(a)"), "");
        assert_eq!(of("a^2 * b"), "b");
        assert_eq!(of("min(a, b)"), "");
    }
}
