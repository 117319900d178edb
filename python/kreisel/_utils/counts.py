"""Numbers with their nouns in messages."""


def format_count(number: int, noun: str) -> str:
    """Return a number and its noun in the singular or plural, such as '1 step' or '2 steps'."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
