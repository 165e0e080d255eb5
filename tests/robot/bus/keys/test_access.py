"""What the hub lets a role do is what the table says, and nothing for whoever is not in force."""

from datetime import UTC, datetime, timedelta

import pytest

from robot.bus.keys import Entry, Ledger, access_rules
from robot.bus.topic import Role
from robot.bus.topics import QUERIES, TOPICS

NOW = datetime(2026, 11, 1, tzinfo=UTC)


def entry(role, number=0, **more):
    fields = {"issued": NOW - timedelta(days=1), "expires": NOW + timedelta(days=1)} | more
    return Entry(name=f"{role}.{number}", role=role, source=str(role), **fields)


def rules_of(*entries):
    ledger = Ledger(authority="a", entries=entries)
    return access_rules(ledger, now=NOW, topics=TOPICS, queries=QUERIES)


def allowed(access, name):
    """Return (message, flow, key) of all that a common name may do."""
    rules = {rule["id"]: rule for rule in access["rules"]}
    roles = [s["id"] for s in access["subjects"] if name in s["cert_common_names"]]
    ids = [i for policy in access["policies"] if set(policy["subjects"]) & set(roles) for i in policy["rules"]]
    return {
        (message, flow, key)
        for rule in (rules[i] for i in ids) for message in rule["messages"] for flow in rule["flows"]
        for key in rule["key_exprs"]
    }  # fmt: skip


@pytest.mark.parametrize("role", Role)
def test_a_role_may_write_ask_and_answer_what_the_table_gives_it_and_no_more(role):
    may = allowed(rules_of(*(entry(r) for r in Role)), f"{role}.0")
    for message, flow, wanted in (
        ("put", "ingress", {t.name for t in TOPICS if role in t.writers}),
        ("query", "ingress", {q.name for q in QUERIES if role in q.asked_by}),
        ("reply", "egress", {q.name for q in QUERIES if role in q.asked_by}),
        ("query", "egress", {q.name for q in QUERIES if role in q.answered_by}),
        ("reply", "ingress", {q.name for q in QUERIES if role in q.answered_by}),
        ("declare_queryable", "ingress", {q.name for q in QUERIES if role in q.answered_by}),
    ):
        keys = {key for m, f, key in may if (m, f) == (message, flow)}
        assert keys == {f"autotelic/*/{name}" for name in wanted}, (message, flow)
    assert ("declare_subscriber", "ingress", "autotelic/**") in may
    assert not [m for m in may if m[0] in ("delete", "liveliness_token")]


def test_whoever_is_revoked_or_over_may_nothing():
    access = rules_of(
        entry(Role.TELEOP, 0, revoked=NOW - timedelta(hours=1)), entry(Role.TELEOP, 1, expires=NOW),
        entry(Role.TELEOP, 2), entry(Role.VIEWER, 0, revoked=NOW),
    )  # fmt: skip
    assert [s["cert_common_names"] for s in access["subjects"]] == [["teleop.2"]]
    assert allowed(access, "teleop.0") == allowed(access, "viewer.0") == set()


def test_what_is_not_allowed_is_denied_and_every_rule_allows():
    access = rules_of(entry(Role.ROBOT))
    assert (access["enabled"], access["default_permission"]) == (True, "deny")
    assert {rule["permission"] for rule in access["rules"]} == {"allow"}
    assert len({rule["id"] for rule in access["rules"]}) == len(access["rules"])
