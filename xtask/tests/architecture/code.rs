//! The parsed source of all crates: modules, their items, and the names they use. Code that is only compiled for tests
//! (`#[cfg(test)]`) is ignored.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, ImplItem, Item, Meta, Type, UseTree, Visibility};

/// A module; an inline module has the file of its parent.
#[derive(Debug, Default)]
pub(crate) struct Module {
    /// Path relative to the repository.
    pub(crate) file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    /// Paths imported by `use`, by local name.
    uses: BTreeMap<String, Vec<String>>,
    /// Paths imported by `use ...::*`.
    globs: Vec<Vec<String>>,
    /// Paths that the module depends on: paths in code, and `use` declarations that are not re-exports.
    paths: BTreeSet<Vec<String>>,
    /// Items by name, with their fields, variants, methods and constants.
    pub(crate) items: BTreeMap<String, BTreeSet<String>>,
}

/// The modules of all crates.
#[derive(Debug, Default)]
pub(crate) struct Code {
    pub(crate) modules: Vec<Module>,
    /// Indices of root modules by crate name, with underscores.
    pub(crate) crates: BTreeMap<String, usize>,
}

/// Target of a path: the index of a module, and an item in it unless the path names the module itself.
pub(crate) type Found<'a> = (usize, Option<&'a str>);

/// Imports by file: the files that it depends on, and the names used from each.
pub(crate) type Imports<'a> = BTreeMap<&'a Path, BTreeMap<&'a Path, BTreeSet<&'a str>>>;

impl Code {
    /// Parses the crate in each folder, starting at `src/lib.rs` or `src/main.rs`.
    pub(crate) fn read(root: &Path, folders: &[PathBuf]) -> Self {
        let mut code = Self::default();
        for folder in folders {
            let files = ["src/lib.rs", "src/main.rs"].map(|name| folder.join(name));
            let file = files.iter().find(|file| root.join(file).is_file());
            let file = file.unwrap_or_else(|| panic!("{} has neither a lib.rs nor a main.rs", folder.display()));
            let name = folder.file_name().expect("a folder has a name").to_string_lossy().replace('-', "_");
            let module = code.add(root, file, None);
            code.crates.insert(name, module);
        }
        code
    }

    fn add(&mut self, root: &Path, file: &Path, parent: Option<usize>) -> usize {
        let text = fs::read_to_string(root.join(file)).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let stem = file.file_stem().expect("a file has a name");
        let is_root = ["lib", "main", "mod"].iter().any(|name| stem == *name);
        let folder = file.parent().expect("a file is in a folder");
        let folder = if is_root { folder.to_owned() } else { folder.join(stem) };
        self.fill(root, file, &folder, parent, &parsed.items)
    }

    fn fill(&mut self, root: &Path, file: &Path, folder: &Path, parent: Option<usize>, items: &[Item]) -> usize {
        let index = self.modules.len();
        self.modules.push(Module { file: file.to_owned(), parent, ..Module::default() });
        let mut names = Names::default();
        for item in items.iter().filter(|item| !is_test(attributes(item))) {
            match item {
                Item::Mod(inner) => {
                    let name = inner.ident.to_string();
                    let child = match &inner.content {
                        Some((_, items)) => self.fill(root, file, &folder.join(&name), Some(index), items),
                        None => {
                            let files = [folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs")];
                            let found = files.iter().find(|file| root.join(file).is_file());
                            let found = found
                                .unwrap_or_else(|| panic!("{}: the file of module {name} is missing", file.display()));
                            self.add(root, found, Some(index))
                        }
                    };
                    self.modules[index].children.insert(name, child);
                }
                _ => names.visit_item(item),
            }
        }
        let Names { uses, globs, paths, items } = names;
        let module = &mut self.modules[index];
        (module.uses, module.globs, module.paths, module.items) = (uses, globs, paths, items);
        index
    }

    /// Resolves a path in a module; returns `None` if it leads outside the crate.
    pub(crate) fn find<'a>(&'a self, module: usize, path: &'a [String]) -> Option<Found<'a>> {
        self.look_up(module, path, true, 0)
    }

    fn look_up<'a>(&'a self, module: usize, path: &'a [String], is_first: bool, depth: usize) -> Option<Found<'a>> {
        let Some((name, rest)) = path.split_first() else { return Some((module, None)) };
        let here = &self.modules[module];
        // Circular aliases have no target.
        if depth > 20 {
            return None;
        }
        match name.as_str() {
            "crate" if is_first => return self.look_up(self.root_of(module), rest, false, depth),
            "self" if is_first => return self.look_up(module, rest, false, depth),
            "super" => return self.look_up(here.parent?, rest, false, depth),
            _ => {}
        }
        if let Some(&child) = here.children.get(name) {
            return self.look_up(child, rest, false, depth);
        }
        if let Some((item, _)) = here.items.get_key_value(name) {
            return Some((module, Some(item)));
        }
        if let Some(target) = here.uses.get(name) {
            return match self.look_up(module, target, true, depth + 1)? {
                (found, None) => self.look_up(found, rest, false, depth),
                item => Some(item),
            };
        }
        let mut through = here.globs.iter().filter_map(|glob| match self.look_up(module, glob, true, depth + 1)? {
            (found, None) if found != module => self.look_up(found, path, false, depth + 1),
            _ => None,
        });
        through.find(|found| found.1.is_some() || !is_first)
    }

    fn root_of(&self, module: usize) -> usize {
        self.modules[module].parent.map_or(module, |parent| self.root_of(parent))
    }

    /// Returns the imports of each file.
    pub(crate) fn imports(&self) -> Imports<'_> {
        let mut imports = Imports::new();
        for (index, module) in self.modules.iter().enumerate() {
            let from = imports.entry(&module.file).or_default();
            for path in &module.paths {
                // A single identifier may be a variable with the name of a module.
                if let Some((found, item)) = self.find(index, path)
                    && (path.len() > 1 || item.is_some())
                    && self.modules[found].file != module.file
                {
                    from.entry(&self.modules[found].file).or_default().extend(item);
                }
            }
        }
        imports
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Ident>().is_ok_and(|word| word == "test")
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Collects the names that a module's items define and use.
#[derive(Default)]
struct Names {
    uses: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    paths: BTreeSet<Vec<String>>,
    items: BTreeMap<String, BTreeSet<String>>,
}

impl Names {
    fn bring_in(&mut self, tree: &UseTree, before: &[String], passes_on: bool) {
        let with = |name: &syn::Ident| {
            let name = (name != "self" || before.is_empty()).then(|| name.to_string());
            [before, name.as_slice()].concat()
        };
        let (name, path) = match tree {
            UseTree::Path(path) => return self.bring_in(&path.tree, &with(&path.ident), passes_on),
            UseTree::Group(group) => return group.items.iter().for_each(|tree| self.bring_in(tree, before, passes_on)),
            UseTree::Glob(_) => {
                self.globs.push(before.to_vec());
                (None, before.to_vec())
            }
            UseTree::Name(name) => (with(&name.ident).last().cloned(), with(&name.ident)),
            UseTree::Rename(name) => (Some(name.rename.to_string()), with(&name.ident)),
        };
        if let Some(name) = name {
            self.uses.insert(name, path.clone());
        }
        if !passes_on {
            self.paths.insert(path);
        }
    }

    fn define(&mut self, item: &syn::Ident, members: impl IntoIterator<Item = String>) {
        self.items.entry(item.to_string()).or_default().extend(members);
    }

    /// Finds paths in the tokens of a macro, which have no known syntax, and the types that it defines: `struct` or
    /// `enum`, a name, and later a group in braces with the names of its members.
    fn scan(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        let (mut is_name, mut defined) = (false, None);
        for token in tokens {
            let is_named = std::mem::take(&mut is_name);
            match token {
                TokenTree::Ident(word) => {
                    if is_named {
                        defined = Some(word.clone());
                    }
                    is_name = word == "struct" || word == "enum";
                    if colons != 2 {
                        self.paths.insert(std::mem::take(&mut path));
                    }
                    path.push(word.to_string());
                    colons = 0;
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Group(group) => {
                    if group.delimiter() == Delimiter::Brace
                        && let Some(name) = defined.take()
                    {
                        let mut members = BTreeSet::new();
                        words(group.stream(), &mut members);
                        self.define(&name, members);
                    }
                    self.scan(group.stream());
                    colons = 0;
                }
                _ => colons = 0,
            }
        }
        self.paths.insert(path);
    }
}

/// Collects all identifiers in tokens.
fn words(tokens: TokenStream, found: &mut BTreeSet<String>) {
    for token in tokens {
        match token {
            TokenTree::Ident(word) => drop(found.insert(word.to_string())),
            TokenTree::Group(group) => words(group.stream(), found),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

fn fields(fields: &syn::Fields) -> impl Iterator<Item = String> + '_ {
    fields.iter().filter_map(|field| Some(field.ident.as_ref()?.to_string()))
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_test(attributes(item)) {
            return;
        }
        match item {
            Item::Const(item) => self.define(&item.ident, []),
            Item::Static(item) => self.define(&item.ident, []),
            Item::Fn(item) => self.define(&item.sig.ident, []),
            Item::Type(item) => self.define(&item.ident, []),
            Item::Macro(item) => item.ident.iter().for_each(|name| self.define(name, [])),
            Item::Struct(item) => self.define(&item.ident, fields(&item.fields)),
            Item::Enum(item) => self.define(&item.ident, item.variants.iter().map(|variant| variant.ident.to_string())),
            Item::Trait(item) => {
                let methods = item.items.iter().filter_map(|item| match item {
                    syn::TraitItem::Fn(method) => Some(method.sig.ident.to_string()),
                    _ => None,
                });
                self.define(&item.ident, methods);
            }
            Item::Impl(item) => {
                if let Type::Path(path) = &*item.self_ty
                    && let Some(name) = path.path.get_ident().or(path.path.segments.last().map(|last| &last.ident))
                {
                    let members = item.items.iter().filter_map(|item| match item {
                        ImplItem::Fn(method) if !is_test(&method.attrs) => Some(method.sig.ident.to_string()),
                        ImplItem::Const(constant) => Some(constant.ident.to_string()),
                        _ => None,
                    });
                    self.items.entry(format!("impl {name}")).or_default().extend(members);
                }
            }
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_impl_item_fn(&mut self, method: &'ast syn::ImplItemFn) {
        if !is_test(&method.attrs) {
            visit::visit_impl_item_fn(self, method);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.bring_in(&item.tree, &[], !matches!(item.vis, Visibility::Inherited));
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.insert(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, inner: &'ast syn::Macro) {
        self.scan(inner.tokens.clone());
        visit::visit_macro(self, inner);
    }

    fn visit_visibility(&mut self, _: &'ast Visibility) {}

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Meta::List(list) = &attribute.meta {
            self.scan(list.tokens.clone());
        }
    }
}
