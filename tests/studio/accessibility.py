"""What axe-core has to say about a page."""

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

GRAVE = ("serious", "critical")


def grave_violations(tab: Page) -> list[str]:
    """Serious and critical violations, one line each with the first element that has it."""
    found = Axe().run(tab).response["violations"]
    return [
        f"{each['id']} ({each['impact']}): {each['help']}; {len(each['nodes'])} times, first {each['nodes'][0]['html'][:200]}"
        for each in found
        if each["impact"] in GRAVE
    ]
