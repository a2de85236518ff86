//! Arithmetic over named quantities: text to a stack program, and its value without allocation.

use super::function::Function;
use std::ops::Range;
use thiserror::Error;

/// Longest expression, bytes.
pub const LONGEST: usize = 1000;
/// Deepest nesting, and highest stack.
pub const DEEPEST: usize = 32;

/// A program for a machine with a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression<V> {
    /// In reverse Polish order.
    pub(super) program: Vec<Operation<V>>,
}

/// One step of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operation<V> {
    Constant(f64),
    Variable(V),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Call(Function),
}

/// What is wrong with an expression, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{problem}")]
pub struct ExpressionError {
    /// The bytes of the text that are meant.
    pub span: Range<usize>,
    /// What is wrong.
    pub problem: Problem,
}

/// What can be wrong.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Problem {
    /// Nothing there.
    #[error("the expression is empty")]
    Empty,
    /// Longer than [`LONGEST`].
    #[error("the expression is longer than {LONGEST} bytes")]
    TooLong,
    /// Nested deeper than [`DEEPEST`].
    #[error("the expression is nested deeper than {DEEPEST} levels")]
    TooDeep,
    /// A character with no meaning here.
    #[error("'{0}' has no meaning here")]
    Stray(char),
    /// The end, or an operator, where a value should stand.
    #[error("expected a value here: a number, a name, a function or a parenthesis")]
    MissingValue,
    /// A value where an operator should stand.
    #[error("expected an operator here: + - * / ^")]
    MissingOperator,
    /// A parenthesis that is not closed.
    #[error("this parenthesis is not closed")]
    Unclosed,
    /// Not a number.
    #[error("'{0}' is not a number")]
    NotANumber(String),
    /// A name of nothing.
    #[error("there is no '{name}': {known}")]
    UnknownName {
        /// As written.
        name: String,
        /// What there is.
        known: String,
    },
    /// A call of something that is no function.
    #[error("there is no function '{name}': it has {known}")]
    UnknownFunction {
        /// As written.
        name: String,
        /// What there is.
        known: String,
    },
    /// Too few or too many arguments.
    #[error("{name} takes {takes} arguments, not {given}")]
    Arguments {
        /// The function.
        name: &'static str,
        /// How many it takes.
        takes: usize,
        /// How many stand there.
        given: usize,
    },
}

impl<V: Copy> Expression<V> {
    /// The variables, in order of appearance, repeated where they are.
    pub fn variables(&self) -> impl Iterator<Item = V> + '_ {
        self.program.iter().filter_map(|operation| match operation {
            Operation::Variable(v) => Some(*v),
            _ => None,
        })
    }

    /// The same program over other variables.
    pub(super) fn map<W>(&self, mut to: impl FnMut(V) -> W) -> Expression<W> {
        let program = self.program.iter().map(|operation| match *operation {
            Operation::Variable(v) => Operation::Variable(to(v)),
            Operation::Constant(c) => Operation::Constant(c),
            Operation::Negate => Operation::Negate,
            Operation::Add => Operation::Add,
            Operation::Subtract => Operation::Subtract,
            Operation::Multiply => Operation::Multiply,
            Operation::Divide => Operation::Divide,
            Operation::Power => Operation::Power,
            Operation::Call(function) => Operation::Call(function),
        });
        Expression { program: program.collect() }
    }

    /// Its value, where `value` gives that of each variable. Allocates nothing.
    pub fn evaluate(&self, mut value: impl FnMut(V) -> f64) -> f64 {
        let mut stack = [0.0; DEEPEST];
        let mut top = 0;
        for operation in &self.program {
            let (taken, result) = match *operation {
                Operation::Constant(c) => (0, c),
                Operation::Variable(v) => (0, value(v)),
                Operation::Negate => (1, -stack[top - 1]),
                Operation::Add => (2, stack[top - 2] + stack[top - 1]),
                Operation::Subtract => (2, stack[top - 2] - stack[top - 1]),
                Operation::Multiply => (2, stack[top - 2] * stack[top - 1]),
                Operation::Divide => (2, stack[top - 2] / stack[top - 1]),
                Operation::Power => (2, power(stack[top - 2], stack[top - 1])),
                Operation::Call(f) => (f.arity(), f.value(&stack[top - f.arity()..top])),
            };
            top -= taken;
            stack[top] = result;
            top += 1;
        }
        stack[0]
    }

    /// The same in C99, fully parenthesised; `name` gives the text of each variable. It calls `truerate_power`, which is [`power`],
    /// and `truerate_sign`.
    pub(super) fn in_c(&self, name: impl Fn(V) -> String) -> String {
        let mut stack: Vec<String> = Vec::new();
        for operation in &self.program {
            let operands = stack.split_off(stack.len() - operation.taken());
            let infix = |sign: &str| format!("({} {sign} {})", operands[0], operands[1]);
            stack.push(match *operation {
                Operation::Constant(c) => format!("{c:?}"),
                Operation::Variable(v) => name(v),
                Operation::Negate => format!("(-{})", operands[0]),
                Operation::Add => infix("+"),
                Operation::Subtract => infix("-"),
                Operation::Multiply => infix("*"),
                Operation::Divide => infix("/"),
                Operation::Power => format!("truerate_power({})", operands.join(", ")),
                Operation::Call(function) => format!("{}({})", function.in_c(), operands.join(", ")),
            });
        }
        stack.pop().unwrap_or_default()
    }

    /// Highest the stack gets.
    pub(super) fn height(&self) -> usize {
        let (mut now, mut highest) = (0_usize, 0);
        for operation in &self.program {
            now = now + 1 - operation.taken();
            highest = highest.max(now);
        }
        highest
    }
}

impl<V> Operation<V> {
    /// How many values it takes from the stack; each puts one back.
    pub(super) fn taken(&self) -> usize {
        match self {
            Self::Constant(_) | Self::Variable(_) => 0,
            Self::Negate => 1,
            Self::Add | Self::Subtract | Self::Multiply | Self::Divide | Self::Power => 2,
            Self::Call(function) => function.arity(),
        }
    }
}

/// Small whole exponents by multiplication, so that x^2 is exactly x·x.
fn power(base: f64, exponent: f64) -> f64 {
    if exponent.fract() == 0.0 && exponent.abs() <= 16.0 { base.powi(exponent as i32) } else { base.powf(exponent) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// x = 2, y = 3 and nothing else.
    fn compile(text: &str) -> Result<Expression<f64>, ExpressionError> {
        Expression::parse(text, |name| match name {
            "x" => Ok(2.0),
            "y" => Ok(3.0),
            _ => Err("it has x, y".to_owned()),
        })
    }

    fn value(text: &str) -> f64 {
        compile(text).unwrap().evaluate(|v| v)
    }

    #[test]
    fn arithmetic_has_its_usual_order() {
        assert_eq!(value("1 + 2 * 3 - 4 / 2"), 5.0);
        assert_eq!(value("-2^2"), -4.0);
        assert_eq!(value("2^3^2"), 512.0);
        assert_eq!(value("2^-1 * x"), 1.0);
        assert_eq!(value("8 - 3 - 2"), 3.0);
        assert_eq!(value(" ( x + y ) * -( 1 - 2 ) "), 5.0);
        assert_eq!(value("1.5e-3 + 2E+1 + .5"), 20.5015);
        assert_eq!(value("min(x, max(y, 1)) + abs(-x)"), 4.0);
        assert!((value("sin(pi / 2) + ln(exp(2)) + log10(100) + sqrt(16) + sign(-7)") - 8.0).abs() < 1e-12);
    }

    #[test]
    fn mistakes_are_found_where_they_are() {
        let found = |text: &str| compile(text).unwrap_err();
        for (text, span, says) in [
            ("", 0..0, "empty"),
            ("x + zeta * 2", 4..8, "there is no 'zeta': it has x, y"),
            ("x + ", 4..4, "expected a value"),
            ("x * / y", 4..5, "expected a value"),
            ("x y", 2..3, "expected an operator"),
            ("3 (x)", 2..3, "expected an operator"),
            ("(x + 1", 0..1, "not closed"),
            ("sin(x", 3..4, "not closed"),
            ("x)", 1..2, "')' has no meaning"),
            ("x # y", 2..3, "'#' has no meaning"),
            ("2 * µ", 4..6, "'µ' has no meaning"),
            ("sine(x)", 0..4, "no function 'sine'"),
            ("min(x) + 1", 0..6, "min takes 2 arguments, not 1"),
            ("1e-3x", 0..5, "not a number"),
            ("1e999", 0..5, "not a number"),
        ] {
            let error = found(text);
            assert_eq!(error.span, span, "{text}: {error}");
            assert!(error.to_string().contains(says), "{text}: {error}");
        }
        assert_eq!(found(&"(".repeat(900)).problem, Problem::TooDeep);
        assert_eq!(found(&"-".repeat(900)).problem, Problem::TooDeep);
        assert_eq!(found(&"x+".repeat(900)).problem, Problem::TooLong);
        assert_eq!(found(&format!("{}x{}", "x^(".repeat(31), ")".repeat(31))).problem, Problem::TooDeep);
    }

    proptest! {
        #[test]
        fn no_text_makes_the_parser_panic_and_every_place_is_in_the_text(text in "[-+*/^(),.xye0-9 µ°a-z]{0,60}") {
            match compile(&text) {
                Ok(expression) => { expression.evaluate(|v| v); }
                Err(error) => prop_assert!(text.get(error.span).is_some()),
            }
        }
    }
}
