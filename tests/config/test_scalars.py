"""Scalars of the YAML 1.2 core schema."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.config.yaml_scalars import json_as_yaml, quote_value, resolve_scalar, to_flow_yaml
from gen_data.config.yaml_tree import parse_yaml

# Expected values: YAML 1.2.2, sections 10.2.1 and 10.3.2.
CORE_SCHEMA = [("", None), ("~", None), ("null", None), ("true", True), ("FALSE", False),
               ("no", "no"), ("on", "on"), ("0", 0), ("-19", -19), ("+12", 12), ("010", 10),
               ("0o14", 12), ("0x1A", 26), ("1_000", "1_000"), ("1:30", "1:30"), ("1.", 1.0),
               ("-0.5", -0.5), (".5", 0.5), ("1e3", 1000.0), ("-2E+05", -200000.0),
               ("2020-99-99", "2020-99-99"), ("2001-12-14", "2001-12-14"), ("1.2.3", "1.2.3"),
               ("0b1", "0b1"), ("=", "=")]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), CORE_SCHEMA)
def test_unquoted_scalars_follow_the_core_schema(text: str, value: object) -> None:
    """Words that YAML 1.1 reads as a date, a boolean or base sixty are strings."""
    resolved = resolve_scalar(text)
    assert resolved == value
    assert type(resolved) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [(".nan", ".nan is not a finite number"), ("-.inf", "-.inf is not a finite number"),
     ("1e999", "1e999 is too large for a number"),
     (str(2**63), "9223372036854775808 is too large for a whole number (64 bits)"),
     ("-" + "9" * 4000, "-" + "9" * 56 + "... is too large for a whole number (64 bits)"),
     ("0x" + "f" * 17, "fffffffffffffffff is too large for a whole number (64 bits)")],
)  # fmt: skip
def test_numbers_that_cannot_be_held_are_refused(text: str, message: str) -> None:
    """Not silently rounded, wrapped or made infinite."""
    with pytest.raises(ValueError, match=r".") as caught:
        resolve_scalar(text)
    assert str(caught.value) == message


def test_the_largest_whole_number_is_two_to_the_63_minus_1() -> None:
    assert resolve_scalar("000" + "0" * 90 + str(2**63 - 1)) == 2**63 - 1
    assert resolve_scalar(str(-(2**63) + 1)) == -(2**63) + 1


PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63) + 1, 2**63 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(min_codepoint=32, max_codepoint=0xD7FF, exclude_categories=["Cc"])),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text("abcdefgh: #-", min_size=1, max_size=6), inner, max_size=4)
    ),
    max_leaves=12,
)


@pytest.mark.slow
@settings(max_examples=300, deadline=None, derandomize=True)
@given(PLAIN)
def test_what_is_written_in_flow_style_reads_back_equal(value: object) -> None:
    """``to_flow_yaml`` is the inverse of reading: defaults can be shown as YAML and pasted."""
    assert parse_yaml(f"value: {to_flow_yaml(value)}\n", "x.yaml").plain() == {"value": value}


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.0, "1"), (0.1, "0.1"), (True, "true"), ("no", "no"), ("1:30", '"1:30"'), ("true", '"true"'),
     ("", '""'), ({"uniform": [0.25, 2.0]}, "{uniform: [0.25, 2]}"), ("mug?seed=3", "mug?seed=3")],
)  # fmt: skip
def test_flow_style_is_what_a_person_would_write(value: object, text: str) -> None:
    """Quotes only where needed, no trailing zeros."""
    assert to_flow_yaml(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [("a b", "'a b'"), ("two\nlines", "'two\\nlines'"), ("\x1b[31m", "'\\x1b[31m'"),
     ("x" * 100, "'" + "x" * 57 + "...'"), (None, "nothing"), (1.0, "1"), ([1, "a"], "[1, a]")],
)  # fmt: skip
def test_messages_quote_values_on_one_printable_line(value: object, text: str) -> None:
    """A value cannot break a message apart or steer the terminal."""
    assert quote_value(value) == text


@pytest.mark.parametrize("text", ["x\u2028y", "x\u2029y", "\ufeffx", "ä 🚗"])
def test_values_of_a_plan_are_read_back_as_yaml(text: str) -> None:
    """JSON leaves characters unescaped that no YAML document may have; numbers keep their form."""
    plain = {text: [text, 5, 5.0, 1e-05]}
    assert repr(parse_yaml(json_as_yaml(plain), "plan.json").plain()) == repr(plain)
