"""Who may do what on the bus: nothing but what the table of topics says of his role. Plain values for Zenoh's filter.

Zenoh matches keys by inclusion and drops what is denied without a word to who sent it. All rules are the hub's, by the
direction in which a message crosses its link to one process.
"""

from collections.abc import Iterable
from datetime import datetime
from typing import Any

from robot.bus.keys.ledger import Ledger
from robot.bus.topic import ROOT, Query, Role, Topic

__all__ = ["access_rules"]

Rule = dict[str, Any]


def access_rules(
    ledger: Ledger, *, now: datetime, topics: Iterable[Topic[Any]], queries: Iterable[Query[Any, Any]]
) -> dict[str, Any]:
    """Return Zenoh's `access_control`: what is not in it is denied.

    Args:
        ledger: Whose certificates are in force; revoked and expired ones name nobody.
        now: Of the hub's machine.
        topics: The table.
        queries: The table.
    """
    topics, queries = tuple(topics), tuple(queries)
    rules: list[Rule] = [
        _rule("read", "ingress", ["declare_subscriber"], [f"{ROOT}/**"]),
        _rule("be_read", "egress", ["put", "declare_subscriber", "declare_queryable"], [f"{ROOT}/**"]),
    ]
    subjects, policies = [], []
    for role in Role:
        names = [e.name for e in ledger.in_force(now) if e.role is role]
        if not names:
            continue
        own = _rules_of(role, topics, queries)
        rules += own
        subjects.append({"id": str(role), "cert_common_names": names})
        policies.append({"rules": ["read", "be_read", *(rule["id"] for rule in own)], "subjects": [str(role)]})
    return {
        "enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies,
    }  # fmt: skip


def _rules_of(role: Role, topics: tuple[Topic[Any], ...], queries: tuple[Query[Any, Any], ...]) -> list[Rule]:
    written = [_keys(t.name) for t in topics if role in t.writers]
    asked = [_keys(q.name) for q in queries if role in q.asked_by]
    answered = [_keys(q.name) for q in queries if role in q.answered_by]
    wanted = (
        ("write", "ingress", ["put"], written),
        ("ask", "ingress", ["query"], asked),
        ("be_answered", "egress", ["reply"], asked),
        ("be_asked", "egress", ["query"], answered),
        ("answer", "ingress", ["declare_queryable", "reply"], answered),
    )
    return [_rule(f"{role}_{what}", flow, messages, keys) for what, flow, messages, keys in wanted if keys]


def _rule(name: str, flow: str, messages: list[str], keys: list[str]) -> Rule:
    return {"id": name, "messages": messages, "flows": [flow], "permission": "allow", "key_exprs": keys}


def _keys(name: str) -> str:
    return f"{ROOT}/*/{name}"
