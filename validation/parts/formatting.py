"""Formatting of numbers and lists for the report."""

from collections import Counter

NUMBERS = (
    *("no", "one", "two", "three", "four", "five", "six"),
    *("seven", "eight", "nine", "ten", "eleven", "twelve"),
)


def number_word(n):
    return NUMBERS[n] if n < len(NUMBERS) else str(n)


def count_word(n):
    """Return the English word for a small number."""
    return number_word(n) if n else "none"


def verb_be(n):
    return "are" if n > 1 else "is"


def format_brief(x):
    """Format a number of 10 or more as an integer, and a smaller one with two digits."""
    return f"{x:.0f}" if x >= 10 else f"{x:.2g}"


def format_large(x):
    """Format a number with two digits and commas, as in 28,000."""
    return f"{float(f'{x:.2g}'):,.0f}" if x >= 10 else format_brief(x)


def format_power(x):
    """Format a power of ten as in 1e-9."""
    return f"{x:.0e}".replace("e-0", "e-")


def format_digits(value, form=".0e"):
    """Format a number, or return a dash for None."""
    return "\N{EN DASH}" if value is None else format(value, form)


def format_milliseconds(seconds):
    """Format a time in milliseconds with three digits, or return a dash for None."""
    if seconds is None:
        return format_digits(None)
    ms = 1e3 * seconds
    places = 0 if ms >= 100 else 1 if ms >= 10 else 2 if ms >= 1 else 3
    return f"{ms:.{places}f}"


def join_words(words):
    """Join words as in 'a, b and c'."""
    words = list(words)
    if not words:
        return "none"
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def join_counts(names):
    """Format a count of each name, as in 'exact (12) and taylor (8)'."""
    return join_words(f"{name} ({count})" for name, count in Counter(names).most_common())


def join_sentences(*sentences):
    """Join all nonempty sentences with spaces."""
    return " ".join(filter(None, sentences))
