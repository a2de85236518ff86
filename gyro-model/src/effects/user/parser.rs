//! The expressions' grammar.
//!
//! ```text
//! sum     = product { ('+' | '-') product }
//! product = sign { ('*' | '/') sign }
//! sign    = ('-' | '+') sign | power
//! power   = atom [ '^' sign ]                      right to left, and before a sign: −2^2 = −4
//! atom    = NUMBER | NAME | FUNCTION '(' sum { ',' sum } ')' | '(' sum ')'
//! ```

use super::{
    expression::{DEEPEST, Expression, ExpressionError, LONGEST, Operation, Problem},
    function::Function,
};

impl<V: Copy> Expression<V> {
    /// Compiles `text`; `name` says what a name stands for, or lists what there is.
    ///
    /// # Errors
    /// Where the text is no expression, with the place.
    pub fn parse(text: &str, name: impl FnMut(&str) -> Result<V, String>) -> Result<Self, ExpressionError> {
        let expression = Self { program: parse(text, name)? };
        if expression.height() > DEEPEST {
            return Err(ExpressionError { span: 0..text.len(), problem: Problem::TooDeep });
        }
        Ok(expression)
    }
}

/// The program of `text`; `name` says what a name stands for, or lists what there is.
fn parse<V: Copy>(
    text: &str,
    name: impl FnMut(&str) -> Result<V, String>,
) -> Result<Vec<Operation<V>>, ExpressionError> {
    if text.len() > LONGEST {
        return Err(ExpressionError { span: LONGEST..text.len(), problem: Problem::TooLong });
    }
    let mut parser = Parser { text, at: 0, depth: 0, program: Vec::new(), name };
    parser.space();
    if parser.at == text.len() {
        return Err(ExpressionError { span: 0..text.len(), problem: Problem::Empty });
    }
    parser.sum()?;
    match parser.peek() {
        None => Ok(parser.program),
        Some(next) if starts_value(next) => Err(parser.here(Problem::MissingOperator)),
        Some(next) => Err(parser.here(Problem::Stray(next))),
    }
}

fn starts_value(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '(')
}

struct Parser<'a, V, N> {
    text: &'a str,
    at: usize,
    depth: usize,
    program: Vec<Operation<V>>,
    name: N,
}

impl<V: Copy, N: FnMut(&str) -> Result<V, String>> Parser<'_, V, N> {
    fn sum(&mut self) -> Result<(), ExpressionError> {
        self.product()?;
        while let Some(operator @ ('+' | '-')) = self.peek() {
            self.advance();
            self.product()?;
            self.program.push(if operator == '+' { Operation::Add } else { Operation::Subtract });
        }
        Ok(())
    }

    fn product(&mut self) -> Result<(), ExpressionError> {
        self.sign()?;
        while let Some(operator @ ('*' | '/')) = self.peek() {
            self.advance();
            self.sign()?;
            self.program.push(if operator == '*' { Operation::Multiply } else { Operation::Divide });
        }
        Ok(())
    }

    fn sign(&mut self) -> Result<(), ExpressionError> {
        self.nested(|parser| match parser.peek() {
            Some('-') => {
                parser.advance();
                parser.sign()?;
                parser.program.push(Operation::Negate);
                Ok(())
            }
            Some('+') => {
                parser.advance();
                parser.sign()
            }
            _ => parser.power(),
        })
    }

    fn power(&mut self) -> Result<(), ExpressionError> {
        self.atom()?;
        if self.peek() == Some('^') {
            self.advance();
            self.sign()?;
            self.program.push(Operation::Power);
        }
        Ok(())
    }

    fn atom(&mut self) -> Result<(), ExpressionError> {
        match self.peek() {
            Some('(') => {
                let open = self.at;
                self.advance();
                self.sum()?;
                self.close(open)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.word(),
            Some(c) if !"+-*/^,)".contains(c) => Err(self.here(Problem::Stray(c))),
            _ => Err(self.here(Problem::MissingValue)),
        }
    }

    fn number(&mut self) -> Result<(), ExpressionError> {
        let (start, bytes) = (self.at, self.text.as_bytes());
        let mut end = start;
        while end < bytes.len() {
            let signs_exponent = matches!(bytes[end], b'+' | b'-') && matches!(bytes[end - 1], b'e' | b'E');
            if !(bytes[end].is_ascii_alphanumeric() || matches!(bytes[end], b'.' | b'_') || signs_exponent) {
                break;
            }
            end += 1;
        }
        let written = &self.text[start..end];
        let value = written.parse::<f64>().ok().filter(|v| v.is_finite());
        let value = value
            .ok_or_else(|| ExpressionError { span: start..end, problem: Problem::NotANumber(written.to_owned()) })?;
        self.program.push(Operation::Constant(value));
        self.at = end;
        self.space();
        Ok(())
    }

    fn word(&mut self) -> Result<(), ExpressionError> {
        let start = self.at;
        let length = self.text[start..].find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        let end = length.map_or(self.text.len(), |length| start + length);
        let word = &self.text[start..end];
        self.at = end;
        self.space();
        let open = self.at;
        if self.peek() != Some('(') {
            match (self.name)(word) {
                Ok(variable) => self.program.push(Operation::Variable(variable)),
                Err(_) if word == "pi" => self.program.push(Operation::Constant(std::f64::consts::PI)),
                Err(known) => {
                    let problem = Problem::UnknownName { name: word.to_owned(), known };
                    return Err(ExpressionError { span: start..end, problem });
                }
            }
            return Ok(());
        }
        let function = Function::find(word).ok_or_else(|| ExpressionError {
            span: start..end,
            problem: Problem::UnknownFunction { name: word.to_owned(), known: Function::names() },
        })?;
        self.advance();
        let mut given = 1;
        self.sum()?;
        while self.peek() == Some(',') {
            self.advance();
            self.sum()?;
            given += 1;
        }
        self.close(open)?;
        if given != function.arity() {
            let problem = Problem::Arguments { name: function.name(), takes: function.arity(), given };
            return Err(ExpressionError { span: start..self.text[..self.at].trim_end().len(), problem });
        }
        self.program.push(Operation::Call(function));
        Ok(())
    }

    fn close(&mut self, open: usize) -> Result<(), ExpressionError> {
        match self.peek() {
            Some(')') => {
                self.advance();
                Ok(())
            }
            None => Err(ExpressionError { span: open..open + 1, problem: Problem::Unclosed }),
            Some(c) if starts_value(c) => Err(self.here(Problem::MissingOperator)),
            Some(c) => Err(self.here(Problem::Stray(c))),
        }
    }

    /// One level deeper, if that is not too deep.
    fn nested(&mut self, parse: impl FnOnce(&mut Self) -> Result<(), ExpressionError>) -> Result<(), ExpressionError> {
        if self.depth >= DEEPEST {
            return Err(self.here(Problem::TooDeep));
        }
        self.depth += 1;
        let parsed = parse(self);
        self.depth -= 1;
        parsed
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn advance(&mut self) {
        self.at += self.peek().map_or(0, char::len_utf8);
        self.space();
    }

    fn space(&mut self) {
        self.at = self.text.len() - self.text[self.at..].trim_start().len();
    }

    fn here(&self, problem: Problem) -> ExpressionError {
        ExpressionError { span: self.at..self.at + self.peek().map_or(0, char::len_utf8), problem }
    }
}
