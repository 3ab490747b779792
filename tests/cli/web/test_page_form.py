"""The form for a message: flags that are refused, and types that contain themselves. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.async_api import expect

from actors import Child, Supervisor
from tests.cli.web.browsing import browsing
from tests.cli.web.stage import Talker

pytestmark = [pytest.mark.browser]

TREE = [
    {
        "type": "demo/Branch",
        "fieldnames": ["ripe", "weight", "parent", "leaves"],
        "fieldtypes": ["bool", "float64", "demo/Branch", "demo/Branch"],
        "fieldarraylen": [-1, -1, -1, 0],
        "examples": ["False", "0.5", "{}", "[]"],
    }
]
"""As rosapi describes a type that contains itself: once, and in an array."""


async def test_a_flag_that_is_refused_is_marked_and_a_type_within_itself_ends() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Talker)])) as visit:
        await visit.open("topics")
        page = visit.page
        await page.evaluate(
            """async (typedefs) => {
                const { Form } = await import("./core/form.js");
                globalThis.form = new Form(typedefs);
                document.body.append(form.element);
            }""",
            TREE,
        )
        form = page.locator(".form")
        ripe, add = form.get_by_label("ripe bool"), form.get_by_role("button", name="Add one")
        assert await page.evaluate("form.blame('Branch.ripe: it is winter')")
        await expect(ripe).to_have_attribute("aria-invalid", "true")
        await expect(form.get_by_role("status").first).to_have_text("it is winter")
        await ripe.check()
        await expect(ripe).not_to_have_attribute("aria-invalid", "true")
        await expect(form.get_by_role("group", name="parent")).to_have_count(0)
        await add.click()
        await add.first.click()
        await form.get_by_label("weight").last.fill("2")
        read: dict[str, Any] = await page.evaluate("form.read()")
        inner = {"ripe": False, "weight": 2, "leaves": []}
        assert read == {"ripe": True, "weight": 0.5, "leaves": [{"ripe": False, "weight": 0.5, "leaves": [inner]}]}
