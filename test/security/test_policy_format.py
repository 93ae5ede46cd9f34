"""The policies have the published format of SROS2, and say nothing that it would misunderstand."""

import pytest
from lxml import etree
from security.policies import FOLDER, INCLUDE, POLICY, RULES, SCHEMA, enclaves, load_policy, published_schema

NEEDS_SROS2 = "needs the package sros2 of a ROS distribution"


def test_the_policy_is_valid_by_the_published_schema():
    published_schema().assertValid(load_policy())


def test_every_file_that_ships_is_the_policy_or_a_part_of_it():
    files = list(FOLDER.iterdir())
    parts = {part.get("href") for path in files for part in etree.parse(str(path)).iter(INCLUDE)}
    assert {path.name for path in files} == {POLICY.name} | parts


# Changes of the policy, each with what the schema says of it.
MISTAKES = {
    "version": (lambda policy: policy.set("version", "0.1.0"), "'version': The value '0.1.0' does not match"),
    "no enclaves": (lambda policy: policy.remove(policy[0]), "'policy': Missing child element"),
    "no path": (
        lambda policy: policy[0][0].attrib.pop("path"),
        "'enclave': The attribute 'path' is required",
    ),
    "no node": (
        lambda policy: a_profile(policy).attrib.pop("node"),
        "'profile': The attribute 'node' is required",
    ),
    "attribute": (lambda policy: policy[0][0].set("kind", "x"), "The attribute 'kind' is not allowed"),
    "rule": (lambda policy: topics(policy).set("call", "ALLOW"), "The attribute 'call' is not allowed"),
    "qualifier": (
        lambda policy: topics(policy).set("publish", "allow"),
        "not an element of the set {'ALLOW', 'DENY'}",
    ),
    "kind of name": (
        lambda policy: etree.SubElement(topics(policy), "service"),
        "'service': This element is not",
    ),
    "element": (
        lambda policy: etree.SubElement(a_profile(policy), "topcis"),
        "'topcis': This element is not",
    ),
    "no names": (lambda policy: topics(policy).clear(), "'topics': Missing child element"),
    "include left": (
        lambda policy: etree.SubElement(a_profile(policy), INCLUDE),
        "include': This element is not",
    ),
}


def a_profile(policy):
    return next(policy.iter("profile"))


def topics(policy):
    return next(policy.iter("topics"))


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_published_schema_refuses_a_broken_policy(mistake):
    change, said = MISTAKES[mistake]
    policy = load_policy().getroot()
    change(policy)
    with pytest.raises(etree.DocumentInvalid) as refusal:
        published_schema().assertValid(policy)
    assert said in str(refusal.value)


def test_nothing_stands_in_the_policy_that_the_schema_allows_and_sros2_misunderstands():
    policy = load_policy()
    # sros2 takes every child of <enclaves> for an enclave, comments too, and a blank name for the namespace.
    assert all(isinstance(child.tag, str) for child in policy.find("enclaves"))
    names = [name.text for kind in RULES for name in policy.iter(kind[:-1])]
    assert all(name and not name.isspace() for name in names)


def test_the_policy_only_allows():
    policy = load_policy()
    said = {group.get(rule) for kind, rules in RULES.items() for group in policy.iter(kind) for rule in rules}
    assert said == {"ALLOW", None}


def test_the_schema_is_that_of_the_installed_sros2():
    policy = pytest.importorskip("sros2.policy", reason=NEEDS_SROS2)
    assert policy.get_policy_schema("policy.xsd").read_bytes() == SCHEMA.read_bytes()


def test_sros2_makes_signed_permissions_of_the_policy(tmp_path):
    generation = pytest.importorskip("sros2.api._artifact_generation", reason=NEEDS_SROS2)
    generation.generate_artifacts(tmp_path, [], [POLICY])
    made = {
        f"/{path.parent.relative_to(tmp_path / 'enclaves')}" for path in tmp_path.rglob("permissions.p7s")
    }
    assert made == set(enclaves())
