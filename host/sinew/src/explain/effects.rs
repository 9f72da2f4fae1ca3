//! Explanations of effects, from their descriptions in `sinew-sim`.

use sinew_sim::effects::{Explanation, Kind, Port};

use super::{FORMAT, Group, Law, Parameter, Topic};

/// Every effect, in the order of the vocabulary.
pub(super) fn topics() -> Vec<Topic> {
    Kind::known().into_iter().map(topic).collect()
}

fn topic(kind: Kind) -> Topic {
    let (description, words) = (kind.description(), kind.explanation());
    let parameter = |&(name, meaning): &(&'static str, &'static str)| {
        let mut specs = description.parameters.iter();
        let spec = specs.find(|spec| Explanation::is_about(name, spec.name));
        Parameter {
            name,
            unit: spec.map_or_else(String::new, |spec| spec.quantity.unit_in_words()),
            meaning,
        }
    };
    Topic {
        format: FORMAT,
        name: description.kind,
        group: Group::Effect,
        sits_at: description
            .ports
            .iter()
            .map(|port| component(*port))
            .collect(),
        meaning: words.cause,
        law: Some(Law {
            text: description.law,
            equation: description.equation,
        }),
        parameters: words.parameters.iter().map(parameter).collect(),
        shown_by: Some(description.excited_by),
        confused_with: description.confusable.to_vec(),
        next: words.next,
    }
}

/// The component of a rig file.
fn component(port: Port) -> &'static str {
    match port {
        Port::Body => "body",
        Port::Spring => "spring",
        Port::Tendon => "tendon",
        Port::Actuator => "actuator",
        Port::Sensor => "sensor",
        Port::Pair => "pair of bodies",
    }
}
