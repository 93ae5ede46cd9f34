"""How numbers are told in log lines and diagnostics: `sentence key=value key=value`."""


def value_text(value: object) -> str:
    """Return a value as operators read it: numbers with six digits, nothing else changed."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def with_fields(sentence: str, **fields: object) -> str:
    """Return a log line: a sentence, then what it is about, such as `solving speed=0.4 points=200`."""
    return " ".join([sentence, *(f"{name}={value_text(value)}" for name, value in fields.items())])
