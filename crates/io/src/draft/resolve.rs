//! Resolution of names to shared objects.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Alias, Draft, MAX_DEPTH, Target, unfold};
use crate::diagnostic::{Diagnostic, Diagnostics, Location};
use crate::scene::{Child, ObjectDescription, ObjectId, PluginKind};

/// Objects of a scene file, by number.
#[derive(Default)]
pub(crate) struct Drafts {
    drafts: Vec<Draft>,
    ids: BTreeMap<String, (usize, Location)>,
    aliases: Vec<Alias>,
    root: usize,
}

impl Drafts {
    /// Adds an object. Reports an id that another object already has.
    pub(crate) fn add(
        &mut self,
        mut draft: Draft,
        id: Option<(String, Location)>,
        diagnostics: &mut Diagnostics,
    ) -> usize {
        let index = self.drafts.len();
        if let Some((id, location)) = id {
            self.name(&id, index, &location, diagnostics);
            draft.id = Some(id);
        }
        self.drafts.push(draft);
        index
    }

    /// Gives an object a name for references. Reports a name that another object already has.
    pub(crate) fn name(
        &mut self,
        id: &str,
        index: usize,
        at: &Location,
        diagnostics: &mut Diagnostics,
    ) {
        if let Some((_, first)) = self.ids.get(id) {
            let message = format!("the id '{id}' is taken");
            let help = format!("the first object with this id is at {first}");
            diagnostics.push(Diagnostic::error(message).help(help).at(at));
        } else {
            self.ids.insert(id.to_owned(), (index, at.clone()));
        }
    }

    /// Returns the kind of an object; `None` if it is not known yet.
    pub(crate) fn kind(&self, target: &Target) -> Option<PluginKind> {
        let index = match target {
            Target::Draft(index) => *index,
            Target::Id(id, _) => self.ids.get(id)?.0,
        };
        self.drafts.get(index).map(|draft| draft.kind)
    }

    pub(crate) fn add_alias(&mut self, alias: Alias) {
        self.aliases.push(alias);
    }

    /// Adds the root, which contains all other objects.
    pub(crate) fn set_root(&mut self, draft: Draft) {
        self.root = self.drafts.len();
        self.drafts.push(draft);
    }

    /// Resolves every reference and returns the root. Reports and omits references that lead
    /// nowhere, to an object that contains them, or too deep. Reports references that multiply
    /// objects.
    pub(crate) fn resolve(
        mut self,
        diagnostics: &mut Diagnostics,
    ) -> Option<Arc<ObjectDescription>> {
        for alias in std::mem::take(&mut self.aliases) {
            if let Some(index) = self.find(&alias.target, &alias.location, diagnostics) {
                self.name(&alias.name, index, &alias.name_location, diagnostics);
            }
        }
        let mut links = Vec::with_capacity(self.drafts.len());
        for draft in &self.drafts {
            let targets = draft.children.iter().map(|child| match &child.target {
                Target::Draft(index) => Some(*index),
                Target::Id(id, location) => self.find(id, location, diagnostics),
            });
            links.push(targets.collect::<Vec<_>>());
        }
        let states = self.drafts.into_iter().map(State::Waiting).collect();
        let mut resolver = Resolver {
            states,
            links,
            diagnostics,
        };
        let root = resolver.object(self.root, 0).ok()?.object;
        unfold::check(&root, diagnostics);
        Some(root)
    }

    /// Returns the number of the object with an id. Reports an unknown id.
    fn find(&self, id: &str, at: &Location, diagnostics: &mut Diagnostics) -> Option<usize> {
        if let Some((index, _)) = self.ids.get(id) {
            return Some(*index);
        }
        let help = diagnostics.suggest(id, self.ids.keys().map(String::as_str));
        let message = format!("no object has the id '{id}'");
        diagnostics.push(Diagnostic::error(message).help(help).at(at));
        None
    }
}

/// State of a draft during resolution.
enum State {
    Waiting(Draft),
    /// Object whose children are being resolved.
    Open,
    Done(ObjectWithDepth),
}

/// Object with the number of levels below it.
#[derive(Clone)]
struct ObjectWithDepth {
    object: Arc<ObjectDescription>,
    height: usize,
}

/// Resolver of references, depth first.
struct Resolver<'d> {
    states: Vec<State>,
    /// Children of each draft by number; `None` where a reference leads nowhere.
    links: Vec<Vec<Option<usize>>>,
    diagnostics: &'d mut Diagnostics,
}

impl Resolver<'_> {
    /// Returns the object with this number, or the error of having it at this depth.
    fn object(&mut self, index: usize, depth: usize) -> Result<ObjectWithDepth, &'static str> {
        let too_deep = "references are nested too deeply";
        let state = std::mem::replace(&mut self.states[index], State::Open);
        let resolved = match state {
            State::Open => return Err("this object contains itself"),
            State::Done(resolved) => resolved,
            State::Waiting(draft) if depth > MAX_DEPTH => {
                self.states[index] = State::Waiting(draft);
                return Err(too_deep);
            }
            State::Waiting(draft) => self.build(index, draft, depth),
        };
        self.states[index] = State::Done(resolved.clone());
        if depth + resolved.height > MAX_DEPTH {
            Err(too_deep)
        } else {
            Ok(resolved)
        }
    }

    /// Builds an object from a draft after its children. Reports and omits children that cannot be
    /// built.
    fn build(&mut self, index: usize, draft: Draft, depth: usize) -> ObjectWithDepth {
        let links = std::mem::take(&mut self.links[index]);
        let mut children = Vec::with_capacity(links.len());
        let mut height = 0;
        for (child, link) in draft.children.into_iter().zip(links) {
            let Some(link) = link else { continue };
            match self.object(link, depth + 1) {
                Ok(resolved) => {
                    height = height.max(resolved.height + 1);
                    let name = child.name.map(|(name, _)| name);
                    children.push(Child {
                        name,
                        object: resolved.object,
                        location: child.location,
                    });
                }
                Err(message) => {
                    self.diagnostics
                        .push(Diagnostic::error(message).at(&child.location));
                }
            }
        }
        let object = Arc::new(ObjectDescription {
            number: ObjectId(index),
            kind: draft.kind,
            plugin: draft.plugin,
            id: draft.id,
            properties: draft.properties,
            children,
            location: draft.location,
            plugin_location: draft.plugin_location,
        });
        ObjectWithDepth { object, height }
    }
}
