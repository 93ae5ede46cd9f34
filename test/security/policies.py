"""The security policies as SROS2 reads them: who may do what, with full names."""

from pathlib import Path

from lxml import etree

from walk_optimizer.resources import config_file

FOLDER = config_file("walker.yaml").resolve().parents[1] / "security"
POLICY = FOLDER / "walk_optimizer.policy.xml"
SCHEMA = Path(__file__).with_name("sros2") / "policy.xsd"
INCLUDE = "{http://www.w3.org/2001/XInclude}include"

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


class _WithoutInternet(etree.Resolver):
    """What policy.xsd uses of the schema that it imports from www.w3.org."""

    def resolve(self, url, _public_id, context):
        if url != "http://www.w3.org/2001/03/xml.xsd":
            return None
        return self.resolve_string(
            """<schema xmlns="http://www.w3.org/2001/XMLSchema"
                targetNamespace="http://www.w3.org/XML/1998/namespace">
            <attribute name="base" type="anyURI"/></schema>""",
            context,
        )


def published_schema():
    """The schema by which SROS2 validates policies."""
    parser = etree.XMLParser()
    parser.resolvers.add(_WithoutInternet())
    return etree.XMLSchema(etree.parse(str(SCHEMA), parser))
