//! The functions that an expression can call.

/// One function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Function(usize);

type Entry = (&'static str, usize, fn(&[f64]) -> f64);

/// Name, number of arguments, value. `log` is the natural logarithm, as `ln`; sign(0) = 0.
static TABLE: [Entry; 21] = [
    ("sin", 1, |a| a[0].sin()),
    ("cos", 1, |a| a[0].cos()),
    ("tan", 1, |a| a[0].tan()),
    ("asin", 1, |a| a[0].asin()),
    ("acos", 1, |a| a[0].acos()),
    ("atan", 1, |a| a[0].atan()),
    ("atan2", 2, |a| a[0].atan2(a[1])),
    ("sinh", 1, |a| a[0].sinh()),
    ("cosh", 1, |a| a[0].cosh()),
    ("tanh", 1, |a| a[0].tanh()),
    ("exp", 1, |a| a[0].exp()),
    ("ln", 1, |a| a[0].ln()),
    ("log", 1, |a| a[0].ln()),
    ("log10", 1, |a| a[0].log10()),
    ("sqrt", 1, |a| a[0].sqrt()),
    ("abs", 1, |a| a[0].abs()),
    ("sign", 1, |a| if a[0] == 0.0 { 0.0 } else { a[0].signum() }),
    ("floor", 1, |a| a[0].floor()),
    ("round", 1, |a| a[0].round()),
    ("min", 2, |a| a[0].min(a[1])),
    ("max", 2, |a| a[0].max(a[1])),
];

impl Function {
    pub(super) fn find(name: &str) -> Option<Self> {
        TABLE.iter().position(|entry| entry.0 == name).map(Self)
    }

    pub(super) fn names() -> String {
        TABLE.map(|entry| entry.0).join(", ")
    }

    pub(super) fn name(self) -> &'static str {
        TABLE[self.0].0
    }

    /// The C99 function that does the same.
    pub(super) fn in_c(self) -> &'static str {
        match self.name() {
            "ln" => "log",
            "abs" => "fabs",
            "sign" => "truerate_sign",
            "min" => "fmin",
            "max" => "fmax",
            name => name,
        }
    }

    pub(super) fn arity(self) -> usize {
        TABLE[self.0].1
    }

    pub(super) fn value(self, arguments: &[f64]) -> f64 {
        TABLE[self.0].2(arguments)
    }
}
