"""The security policies as SROS2 reads them: who may do what, with full names."""

from dataclasses import dataclass

from lxml import etree

from walk_optimizer.resources import config_file

FOLDER = config_file("walker.yaml").resolve().parents[1] / "security"
POLICY = FOLDER / "walk_optimizer.policy.xml"

# Kind of names and what may be done with them.
RULES = {
    "topics": ("publish", "subscribe"),
    "services": ("reply", "request"),
    "actions": ("execute", "call"),
}


@dataclass(frozen=True)
class Profile:
    """What a node may do.

    Attributes:
        enclave: Path of its enclave.
        node: Full name of the node.
        allowed: Full names by what may be done with them: publish, subscribe, reply...
    """

    enclave: str
    node: str
    allowed: dict[str, frozenset[str]]


def load_policy():
    """The policy file with the parts that it includes."""
    tree = etree.parse(str(POLICY))
    tree.xinclude()
    return tree


def profiles():
    """The profiles by enclave."""
    found = {}
    for enclave in load_policy().iterfind("enclaves/enclave"):
        for profile in enclave.iterfind("profiles/profile"):
            found[enclave.get("path")] = _profile(enclave.get("path"), profile)
    return found


def _profile(enclave, profile):
    namespace, node = profile.get("ns").rstrip("/"), profile.get("node")
    allowed = {rule: set() for rules in RULES.values() for rule in rules}
    for kind, rules in RULES.items():
        for group in profile.iterfind(kind):
            for rule in rules:
                if group.get(rule) == "ALLOW":
                    allowed[rule] |= {_full(one.text.strip(), namespace, node) for one in group}
    return Profile(
        enclave, f"{namespace}/{node}", {rule: frozenset(names) for rule, names in allowed.items()}
    )


def _full(name, namespace, node):
    if name.startswith("/"):
        return name
    return f"{namespace}/{node}{name[1:]}" if name.startswith("~") else f"{namespace}/{name}"


# Elements with their attributes and what they may contain: the format of policies, version 0.2.0.
FORMAT = {
    "policy": ({"version"}, {"enclaves"}),
    "enclaves": (set(), {"enclave"}),
    "enclave": ({"path"}, {"profiles"}),
    "profiles": ({"type"}, {"profile", "metadata"}),
    "profile": ({"ns", "node"}, set(RULES)),
    **{kind: (set(rules), {kind[:-1]}) for kind, rules in RULES.items()},
    **{kind[:-1]: (set(), set()) for kind in RULES},
}
XML_BASE = "{http://www.w3.org/XML/1998/namespace}base"


def problems(element):
    """What of an element is not as the format says."""
    if element.tag not in FORMAT:
        return [f"unknown element {element.tag}"]
    attributes, children = FORMAT[element.tag]
    found = [f"{element.tag}: {name}" for name in set(element.keys()) - attributes - {XML_BASE}]
    for child in element.iterchildren(tag=etree.Element):
        if child.tag not in children:
            found.append(f"{child.tag} in {element.tag}")
        found += problems(child)
    if not children and not (element.text or "").strip():
        found.append(f"{element.tag} without a name")
    return found
