"""Markup of ours in a real page: only what differs is drawn again."""

from __future__ import annotations

import itertools

from tab import Tab

TABLE = '<table class="ex-numbers"><tr><td>{}</td><td><b title="{}">δ1</b></td></tr>{}</table>'
MARKUPS = (
    '<div class="ex-box"></div>',
    f'<div class="ex-box">{TABLE.format("1.5", "one", "")}</div>',
    f'<div class="ex-box">{TABLE.format("2.5 &lt;", "two", "<tr><td>3</td></tr>")}<p>1</p></div>',
    '<div class="ex-box is-on"><a data-press="a">Go</a> or <a data-press="b">Go</a></div>',
    '<div class="ex-box"><a data-press="b" data-value="2">Go</a><svg><path d="M 0 0"/></svg></div>',
    '<div class="ex-note">words</div><div class="ex-box"><svg><path d="M 1 1"/></svg></div>',
    "words alone",
    "",
)
# Put one markup after the other into an element; the numbers of those that differ from what a new
# element holds.
DRAW = """(markups) => markups.flatMap((markup, k) => {
    const element = (window.drawn ??= document.createElement("div"));
    const other = document.createElement("div");
    element.innerHTML = markup;
    other.insertAdjacentHTML("beforeend", markup);
    return element.isEqualNode(other) ? [] : [k];
})"""
MARK = """() => {
    for (const button of document.querySelectorAll("[data-press]")) button.isOld = true;
}"""
SHARE_OF_OLD = """() => {
    const buttons = [...document.querySelectorAll("[data-press]")];
    return buttons.filter((button) => button.isOld).length / buttons.length;
}"""


def test_markup_drawn_after_any_other_is_as_in_a_new_element(tab: Tab) -> None:
    order = [each for pair in itertools.permutations(MARKUPS, 2) for each in pair]
    assert tab.page.evaluate(DRAW, order) == []


def test_markup_whose_numbers_change_keeps_its_buttons(tab: Tab) -> None:
    tab.settle()
    tab.page.evaluate(MARK)
    bar = tab.page.locator(".ex-bar")
    before = bar.text_content()
    tab.type("x", "12.5")
    tab.page.keyboard.press("Tab")
    tab.settle()
    assert bar.text_content() != before
    assert tab.page.evaluate(SHARE_OF_OLD) > 0.9
