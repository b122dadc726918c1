//! Sizes and contents of functions and types.

use crate::source::Source;
use std::collections::BTreeMap;
use syn::visit::{self, Visit};
use syn::{Block, Expr, ExprLit, Ident, ImplItemFn, Item, ItemFn, Lit, Signature, TraitItemFn};

/// Floats that need no name.
const PLAIN: [f64; 4] = [0.0, 0.5, 1.0, 2.0];

/// Contents of a file.
#[derive(Default)]
pub struct Contents {
    /// Name and length in lines of every function with a body.
    pub functions: Vec<(String, usize)>,
    /// Names of types and traits.
    pub types: Vec<String>,
    /// Number of floats in bodies of functions, except those that need no name.
    pub floats: usize,
    in_body: bool,
}

impl Contents {
    /// Collects the contents of one file.
    pub fn of(source: &Source) -> Contents {
        let mut contents = Contents::default();
        if let Some(file) = &source.syntax {
            contents.visit_file(file);
        }
        contents
    }

    fn function(&mut self, signature: &Signature, body: &Block) {
        let lines =
            body.brace_token.span.close().end().line + 1 - signature.fn_token.span.start().line;
        self.functions.push((signature.ident.to_string(), lines));
        let outer = std::mem::replace(&mut self.in_body, true);
        visit::visit_block(self, body);
        self.in_body = outer;
    }

    fn named(&mut self, name: &Ident) {
        self.types.push(name.to_string());
    }
}

impl<'a> Visit<'a> for Contents {
    fn visit_item_fn(&mut self, f: &'a ItemFn) {
        self.function(&f.sig, &f.block);
    }

    fn visit_impl_item_fn(&mut self, f: &'a ImplItemFn) {
        self.function(&f.sig, &f.block);
    }

    fn visit_trait_item_fn(&mut self, f: &'a TraitItemFn) {
        if let Some(body) = &f.default {
            self.function(&f.sig, body);
        }
    }

    fn visit_item(&mut self, item: &'a Item) {
        match item {
            // A declaration, wherever it is.
            Item::Const(_) | Item::Static(_) => return,
            Item::Struct(i) => self.named(&i.ident),
            Item::Enum(i) => self.named(&i.ident),
            Item::Trait(i) => self.named(&i.ident),
            Item::Type(i) => self.named(&i.ident),
            Item::Union(i) => self.named(&i.ident),
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_expr(&mut self, expression: &'a Expr) {
        if let Expr::Lit(ExprLit { lit: Lit::Float(float), .. }) = expression {
            let value: f64 = float.base10_parse().expect("a number");
            self.floats += usize::from(self.in_body && !PLAIN.contains(&value));
        }
        visit::visit_expr(self, expression);
    }
}

/// The value that this share of a package's functions does not exceed.
pub fn quantile(lengths: &mut [usize], share: f64) -> usize {
    lengths.sort_unstable();
    let last = lengths.len().saturating_sub(1);
    lengths.get((last as f64 * share).round() as usize).copied().unwrap_or(0)
}

/// Lengths of all functions of each package.
pub fn lengths<'a>(all: &[(&'a Source, Contents)]) -> BTreeMap<&'a str, Vec<usize>> {
    let mut packages: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (source, contents) in all {
        let lengths = packages.entry(&source.package).or_default();
        lengths.extend(contents.functions.iter().map(|(_, lines)| lines));
    }
    packages
}
