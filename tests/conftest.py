"""The order in which test files run, and control of garbage collection during the tests."""

import gc

# Files with long tests or fixtures. They run first, so that no process ends long after the others.
SLOW = (
    "test_report",
    "test_amalgamation",
    "test_embedding",
    "test_thesis",
    "test_gil",
    "test_atlas",
)


def pytest_collection_modifyitems(items):
    # The tests in a browser follow, because their files take long too. The site is built meanwhile.
    ranks = {name: i for i, name in enumerate(SLOW)} | {"test_site_pages": len(SLOW) + 2}
    items.sort(
        key=lambda item: ranks.get(item.path.stem, len(SLOW) + (item.path.parent.name != "viewer"))
    )


def pytest_collection_finish():
    """Exclude the many objects created by test collection from garbage collection."""
    gc.collect()
    gc.freeze()
