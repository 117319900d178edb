"""Formatting of numbers and lists, used as filters in the templates of the report."""

from collections import Counter
from statistics import median

NUMBERS = (
    *("no", "one", "two", "three", "four", "five", "six"),
    *("seven", "eight", "nine", "ten", "eleven", "twelve"),
)


def format_number(n):
    """Return the English word for a small number."""
    return NUMBERS[n] if n < len(NUMBERS) else str(n)


def format_count(n):
    """Return the English word for a small number, or 'none'."""
    return format_number(n) if n else "none"


def format_brief(x):
    """Format a number of 10 or more as an integer, and a smaller one with two digits."""
    return f"{x:.0f}" if x >= 10 else f"{x:.2g}"


def format_large(x):
    """Format a number with two digits and commas, as in 28,000."""
    return f"{float(f'{x:.2g}'):,.0f}" if x >= 10 else format_brief(x)


def format_power(x, form=".0e"):
    """Format a power of ten as in 1e-9."""
    return format(x, form).replace("e-0", "e-")


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


def format_span(values, form=format_brief):
    """Format the smallest and the largest value, as in '3 to 8', or only one if they agree."""
    return " to ".join(dict.fromkeys(form(bound(values)) for bound in (min, max)))


def join_words(words):
    """Join words as in 'a, b and c'."""
    *others, last = list(words) or ["none"]
    return f"{', '.join(others)} and {last}" if others else last


def join_counts(names):
    """Format a count of each name, as in 'exact (12) and taylor (8)'."""
    return join_words(f"{name} ({count})" for name, count in Counter(names).most_common())


FILTERS = {
    "number": format_number,
    "count_word": format_count,
    "brief": format_brief,
    "large": format_large,
    "power": format_power,
    "digits": format_digits,
    "milliseconds": format_milliseconds,
    "span": format_span,
    "words": join_words,
    "counts": join_counts,
    "median": median,
}
