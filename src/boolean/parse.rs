//! Parser of expressions in text form: names, `& | - ^` and parentheses.

use std::fmt;

use super::BooleanOperation;
use super::expression::{Expression, Term};

/// A fault of an expression. Positions count characters from 0.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// Something other than the expected name or opening parenthesis.
    #[error("expected a name or `(`, found {found}")]
    Operand {
        /// The position.
        at: usize,
        /// The text found there.
        found: Found,
    },
    /// Something other than the expected operator, closing parenthesis or end.
    #[error("expected an operator, one of & | - ^, found {found}")]
    Operator {
        /// The position.
        at: usize,
        /// The text found there.
        found: Found,
    },
    /// A parenthesis that is not closed.
    #[error("this `(` has no matching `)`")]
    Unclosed {
        /// The position of the parenthesis.
        at: usize,
    },
    /// A closing parenthesis that was not opened.
    #[error("this `)` has no matching `(`")]
    Unopened {
        /// The position of the parenthesis.
        at: usize,
    },
    /// A name that belongs to no input.
    #[error("no input is named `{name}`; the inputs are {}", names.join(", "))]
    UnknownName {
        /// The position of its first character.
        at: usize,
        /// The name.
        name: String,
        /// The names of the inputs.
        names: Vec<String>,
    },
    /// An input that the expression does not use.
    #[error("the input `{name}` does not occur in the expression")]
    UnusedName {
        /// Its name.
        name: String,
    },
    /// Two inputs of the same name.
    #[error("two inputs are named `{name}`")]
    RepeatedName {
        /// Their name.
        name: String,
    },
}

impl ExpressionError {
    /// Returns the position of the fault in characters from 0; `None` where it has no position.
    pub fn at(&self) -> Option<usize> {
        match *self {
            ExpressionError::Operand { at, .. }
            | ExpressionError::Operator { at, .. }
            | ExpressionError::Unclosed { at }
            | ExpressionError::Unopened { at }
            | ExpressionError::UnknownName { at, .. } => Some(at),
            ExpressionError::UnusedName { .. } | ExpressionError::RepeatedName { .. } => None,
        }
    }
}

/// The text found where something else was expected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// A character that cannot occur in a name.
    Character(char),
    /// A name.
    Name(String),
    /// The end of the expression.
    End,
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Found::Character(character) => write!(f, "`{character}`"),
            Found::Name(name) => write!(f, "`{name}`"),
            Found::End => write!(f, "the end"),
        }
    }
}

/// An operator or parenthesis whose right-hand side has not been read yet.
enum Pending {
    Operator(BooleanOperation),
    Parenthesis { at: usize },
}

impl Expression {
    /// Parses an expression whose inputs have the given names, each of which must occur.
    ///
    /// The operators are `-` difference, `&` intersection, `^` symmetric difference and `|` union. Precedence falls in this
    /// order, `-` highest, as on the sets of Python and in most languages with these operators; equal ones associate to the
    /// left, and parentheses come before all: `a | b & c - d` is `a | (b & (c - d))`, and `a - b - c` is `(a - b) - c`. Names
    /// consist of letters, digits and `_`. Only memory limits depth and length.
    ///
    /// # Errors
    /// Returns the first fault with its position. Unused names are reported last.
    pub fn parse(text: &str, names: &[impl AsRef<str>]) -> Result<Expression, ExpressionError> {
        if let Some(name) = (1..names.len()).find_map(|i| {
            let name = names[i].as_ref();
            names[..i].iter().any(|other| other.as_ref() == name).then_some(name)
        }) {
            return Err(ExpressionError::RepeatedName { name: name.to_owned() });
        }
        let characters: Vec<char> = text.chars().collect();
        let terms = Reader { characters: &characters, at: 0, terms: Vec::new(), pending: Vec::new() }.read(names)?;
        let mut used = vec![false; names.len()];
        for term in &terms {
            if let Term::Input(index) = *term {
                used[index] = true;
            }
        }
        match used.iter().position(|used| !used) {
            Some(unused) => Err(ExpressionError::UnusedName { name: names[unused].as_ref().to_owned() }),
            None => Ok(Expression::from_terms(terms)),
        }
    }
}

/// An operator-precedence parser with an explicit stack: what is read is appended to `terms` in postfix notation.
struct Reader<'a> {
    characters: &'a [char],
    at: usize,
    terms: Vec<Term>,
    pending: Vec<Pending>,
}

impl Reader<'_> {
    fn read(mut self, names: &[impl AsRef<str>]) -> Result<Vec<Term>, ExpressionError> {
        loop {
            self.operand(names)?;
            self.skip_space();
            while self.peek() == Some(')') {
                self.close()?;
                self.skip_space();
            }
            let Some(character) = self.peek() else { break };
            let Some(operation) = operation_of(character) else {
                return Err(ExpressionError::Operator { at: self.at, found: self.found() });
            };
            self.reduce(|other| binding(other) >= binding(operation));
            self.pending.push(Pending::Operator(operation));
            self.at += 1;
        }
        self.reduce(|_| true);
        match self.pending.pop() {
            Some(Pending::Parenthesis { at }) => Err(ExpressionError::Unclosed { at }),
            Some(Pending::Operator(_)) => unreachable!("all operators up to a parenthesis have been moved to `terms`"),
            None => Ok(self.terms),
        }
    }

    /// Reads opening parentheses and a name.
    fn operand(&mut self, names: &[impl AsRef<str>]) -> Result<(), ExpressionError> {
        self.skip_space();
        while self.peek() == Some('(') {
            self.pending.push(Pending::Parenthesis { at: self.at });
            self.at += 1;
            self.skip_space();
        }
        let (at, found) = (self.at, self.found());
        let Found::Name(name) = found else { return Err(ExpressionError::Operand { at, found }) };
        match names.iter().position(|known| known.as_ref() == name) {
            Some(index) => self.terms.push(Term::Input(index)),
            None => {
                let names = names.iter().map(|name| name.as_ref().to_owned()).collect();
                return Err(ExpressionError::UnknownName { at, name, names });
            }
        }
        self.at += name.chars().count();
        Ok(())
    }

    /// Reads a closing parenthesis.
    fn close(&mut self) -> Result<(), ExpressionError> {
        self.reduce(|_| true);
        match self.pending.pop() {
            Some(_) => self.at += 1,
            None => return Err(ExpressionError::Unopened { at: self.at }),
        }
        Ok(())
    }

    /// Moves pending operators to `terms`, back to the last parenthesis, as long as `is_done` holds for them.
    fn reduce(&mut self, is_done: impl Fn(BooleanOperation) -> bool) {
        while let Some(&Pending::Operator(operation)) = self.pending.last()
            && is_done(operation)
        {
            self.pending.pop();
            self.terms.push(Term::Operation(operation, 2));
        }
    }

    fn peek(&self) -> Option<char> {
        self.characters.get(self.at).copied()
    }

    fn skip_space(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += 1;
        }
    }

    /// Returns the text at the current position.
    fn found(&self) -> Found {
        let name: String = self.characters[self.at..].iter().copied().take_while(|&c| is_of_name(c)).collect();
        match self.peek() {
            None => Found::End,
            Some(character) if name.is_empty() => Found::Character(character),
            Some(_) => Found::Name(name),
        }
    }
}

/// Returns whether a character may occur in a name.
fn is_of_name(character: char) -> bool {
    character.is_alphanumeric() || character == '_'
}

fn operation_of(character: char) -> Option<BooleanOperation> {
    match character {
        '&' => Some(BooleanOperation::Intersection),
        '|' => Some(BooleanOperation::Union),
        '-' => Some(BooleanOperation::Difference),
        '^' => Some(BooleanOperation::Xor),
        _ => None,
    }
}

/// Returns the precedence of an operator.
fn binding(operation: BooleanOperation) -> u32 {
    match operation {
        BooleanOperation::Difference => 4,
        BooleanOperation::Intersection => 3,
        BooleanOperation::Xor => 2,
        BooleanOperation::Union => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 4] = ["a", "b", "c", "d"];

    /// Returns an expression with all its parentheses.
    fn written(text: &str) -> String {
        Expression::parse(text, &NAMES[..]).unwrap().fold(
            |index| ["a", "b", "c", "d"][index].to_owned(),
            |operation, operands| {
                let sign = ["&", "|", "-", "^"][operation as usize];
                format!("({})", operands.join(sign))
            },
        )
    }

    #[test]
    fn operators_have_the_precedence_of_pythons_sets() {
        for (text, expected) in [
            ("a | b & c - d", "(a|(b&(c-d)))"),
            ("a - b & c | d", "(((a-b)&c)|d)"),
            ("a ^ b | c & d", "((a^b)|(c&d))"),
            ("a & b ^ c & d", "((a&b)^(c&d))"),
            ("a-b-c-d", "(((a-b)-c)-d)"),
            ("a - (b - (c - d))", "(a-(b-(c-d)))"),
            ("a & (b | c) - d", "(a&((b|c)-d))"),
            (" ( ( a ) )|((b)&c)\t^d", "(a|((b&c)^d))"),
        ] {
            assert_eq!(written(text), expected, "{text}");
        }
    }

    #[test]
    fn errors_count_characters_to_the_fault() {
        let fault = |text: &str| Expression::parse(text, &["a", "Knochen_2", "größe"]).unwrap_err();
        let character = Found::Character;
        assert_eq!(fault(""), ExpressionError::Operand { at: 0, found: Found::End });
        assert_eq!(fault("größe & "), ExpressionError::Operand { at: 8, found: Found::End });
        assert_eq!(fault("größe && a"), ExpressionError::Operand { at: 7, found: character('&') });
        assert_eq!(fault("größe @ a"), ExpressionError::Operator { at: 6, found: character('@') });
        assert_eq!(fault("größe a"), ExpressionError::Operator { at: 6, found: Found::Name("a".into()) });
        assert_eq!(fault("a (a)"), ExpressionError::Operator { at: 2, found: character('(') });
        assert_eq!(fault("a | (a & (a - a)"), ExpressionError::Unclosed { at: 4 });
        assert_eq!(fault("a | a) & a"), ExpressionError::Unopened { at: 5 });
        assert_eq!(fault("a | ()"), ExpressionError::Operand { at: 5, found: character(')') });
        assert_eq!(fault("- a"), ExpressionError::Operand { at: 0, found: character('-') });
        let ExpressionError::UnknownName { at: 4, name, names } = fault("a | knochen_2") else { panic!("another") };
        assert_eq!((name.as_str(), names.len()), ("knochen_2", 3));
        assert_eq!(fault("a - größe"), ExpressionError::UnusedName { name: "Knochen_2".into() });
        assert_eq!(fault("a - größe").at(), None);
        let twice = Expression::parse("a", &["a", "b", "a"]).unwrap_err();
        assert_eq!(twice, ExpressionError::RepeatedName { name: "a".into() });
    }

    #[test]
    fn parsing_depth_is_not_limited_by_the_stack() {
        const DEPTH: usize = 300_000;
        let text = format!("{}b{}", "a - (".repeat(DEPTH), ")".repeat(DEPTH));
        let expression = Expression::parse(&text, &["a", "b"]).unwrap();
        assert!(expression.holds(|_| true) && !expression.holds(|i| i == 0) && !expression.holds(|i| i == 1));
        let open = "(".repeat(DEPTH);
        assert_eq!(Expression::parse(&open, &["a"]).unwrap_err().at(), Some(DEPTH));
    }
}
