"""Numbers for a terminal."""


def plain_number(number: str) -> str:
    """Digits that can be pasted into a calculation: no thin spaces, a minus sign of ASCII."""
    return number.replace("\u202f", "").replace("−", "-")
