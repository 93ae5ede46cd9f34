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


def load_policy():
    """The policy file with the parts that it includes."""
    tree = etree.parse(str(POLICY))
    tree.xinclude()
    return tree


def enclaves():
    """What an enclave may do, by its path: full names by publish, subscribe, reply..."""
    return {enclave.get("path"): _allowed(enclave) for enclave in load_policy().iterfind("enclaves/enclave")}


def _allowed(enclave):
    allowed = {rule: set() for rules in RULES.values() for rule in rules}
    for profile in enclave.iterfind("profiles/profile"):
        namespace, node = profile.get("ns").rstrip("/"), profile.get("node")
        for kind, rules in RULES.items():
            for group in profile.iterfind(kind):
                names = {_full(one.text.strip(), namespace, node) for one in group}
                for rule in rules:
                    if group.get(rule) == "ALLOW":
                        allowed[rule] |= names
    return allowed


def _full(name, namespace, node):
    if name.startswith("/"):
        return name
    return f"{namespace}/{node}{name[1:]}" if name.startswith("~") else f"{namespace}/{name}"


@dataclass(frozen=True)
class Element:
    """What the format of policies, version 0.2.0, says of an element.

    Attributes:
        children: Elements it may contain; none for those that contain a name.
        required: Attributes it must have.
        optional: Attributes it may have.
        may_be_empty: Whether it may contain nothing.
    """

    children: frozenset[str] = frozenset()
    required: frozenset[str] = frozenset()
    optional: frozenset[str] = frozenset()
    may_be_empty: bool = False


def _element(children="", required="", optional="", **rest):
    return Element(*(frozenset(names.split()) for names in (children, required, optional)), **rest)


FORMAT = {
    "policy": _element("enclaves", required="version"),
    "enclaves": _element("enclave"),
    "enclave": _element("profiles", required="path"),
    "profiles": _element("profile metadata", optional="type"),
    "profile": _element(" ".join(RULES), required="ns node", may_be_empty=True),
    **{kind: _element(kind[:-1], optional=" ".join(rules)) for kind, rules in RULES.items()},
    **{kind[:-1]: _element() for kind in RULES},
}
VALUES = {"version": {"0.2.0"}} | {rule: {"ALLOW", "DENY"} for rules in RULES.values() for rule in rules}
XML_BASE = "{http://www.w3.org/XML/1998/namespace}base"


def problems(element):
    """What of an element is not as the format says."""
    if element.tag not in FORMAT:
        return [f"unknown element {element.tag}"]
    wanted, found = FORMAT[element.tag], _wrong_attributes(element)
    children = list(element.iterchildren(tag=etree.Element))
    found += [f"{child.tag} in {element.tag}" for child in children if child.tag not in wanted.children]
    if wanted.children and not children and not wanted.may_be_empty:
        found.append(f"{element.tag} without {' or '.join(sorted(wanted.children))}")
    if not wanted.children and not (element.text or "").strip():
        found.append(f"{element.tag} without a name")
    return found + [problem for child in children for problem in problems(child)]


def _wrong_attributes(element):
    wanted = FORMAT[element.tag]
    found = [f"{element.tag} without {name}" for name in sorted(wanted.required - set(element.keys()))]
    for name, value in element.items():
        if name not in wanted.required | wanted.optional | {XML_BASE}:
            found.append(f"{element.tag}: {name}")
        elif value not in VALUES.get(name, {value}):
            found.append(f"{element.tag}: {name}={value}")
    return found
