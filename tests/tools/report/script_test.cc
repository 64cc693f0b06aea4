// SPDX-License-Identifier: Apache-2.0
// The page's script, run by Node on a page of stand-ins for the elements that it uses.
#include "tools/report/script.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/tools/tool_support.h"

namespace farpoint::tools::report {
namespace {

// Elements with attributes, children and listeners; enough of a document for one diagram, 444x246 px from
// (62, 30): x 0 .. 100 linear, y 1 .. 100 logarithmic, one line of three points.
constexpr char kPage[] = R"JS(
const assert = require("assert");
class Element {
  constructor(name) {
    Object.assign(this, {name, attributes: {}, children: [], listeners: {}, dataset: {}, style: {}, textContent: ""});
    this.namespaceURI = "svg";
  }
  setAttribute(key, value) { this.attributes[key] = String(value); }
  getAttribute(key) { return key in this.attributes ? this.attributes[key] : null; }
  appendChild(child) { this.children.push(child); return child; }
  replaceChildren(...all) { this.children = all; }
  get childNodes() { return this.children; }
  cloneNode() { const copy = new Element(this.name); copy.children = this.children.slice(); return copy; }
  addEventListener(kind, listener) { this.listeners[kind] = listener; }
  remove() { this.isRemoved = true; }
  setPointerCapture(id) { this.captured = id; }
  querySelector(what) { return {"svg.area": this.area, "g.ticks": this.ticks, title: this.title}[what]; }
  querySelectorAll(what) {
    return this.children.filter(c => c.name === (what.startsWith("g") ? "g" : "polyline"));
  }
  getBoundingClientRect() { return {left: 10, top: 20, width: 520}; }
  send(kind, x, y) {
    this.listeners[kind]({clientX: 10 + x, clientY: 20 + y, pageX: 10 + x, pageY: 20 + y, button: 0, pointerId: 7,
                          preventDefault() {}});
  }
}
const make = (name, attributes) => {
  const element = new Element(name);
  for (const key of Object.keys(attributes)) element.setAttribute(key, attributes[key]);
  return element;
};
const area = make("svg", {x: 62, y: 30, width: 444, height: 246, viewBox: "62 30 444 246"});
area.appendChild(make("polyline", {"data-name": "run", points: "62,276 284,153 506,30 "}));
area.appendChild(make("polyline", {"data-name": "", points: "62,30 506,30 "}));
area.appendChild(make("polyline", {"data-name": "error, m", points: "395,91.5 400,400 ", "data-values": "0.25 0.5"}));
const label = area.appendChild(make("g", {"data-at": "100,200"}));
const ticks = make("g", {}), svg = make("svg", {width: 520});
ticks.children = ["as drawn"];
svg.dataset = {x: "0 100 linear", y: "1 100 log"};
const title = make("title", {});
title.textContent = "Height";
Object.assign(svg, {area, ticks, title});
const body = make("body", {}), hint = make("p", {});
const root = {clientWidth: 1000, clientHeight: 700};
global.document = {body, documentElement: root, createElement: name => new Element(name), createElementNS: (_, name) => new Element(name),
                   querySelectorAll: () => [svg], getElementById: () => hint};
global.window = {scrollX: 0, scrollY: 0};
)JS";

constexpr char kCheck[] = R"JS(
const tip = body.children[0];
assert(hint.textContent.includes("zoom"));
// The browser has no title to show over the values; screen readers have it.
assert(title.isRemoved);
assert.strictEqual(svg.getAttribute("aria-label"), "Height");
Object.assign(tip, {offsetWidth: 200, offsetHeight: 40});
// Values under the pointer, which is near the line's middle point.
svg.send("pointermove", 290, 153);
assert.strictEqual(tip.hidden, false);
assert.strictEqual(tip.textContent.split("\n").length, 2, tip.textContent);
assert(tip.textContent.includes("y 10"), tip.textContent);
assert(tip.textContent.endsWith("run: 10"), tip.textContent);
// Beside the pointer, and within the window.
assert.deepStrictEqual([tip.style.left, tip.style.top], ["314px", "187px"]);
Object.assign(root, {clientWidth: 513, clientHeight: 226});
svg.send("pointermove", 290, 153);
assert.deepStrictEqual([tip.style.left, tip.style.top], ["86px", "119px"]);
Object.assign(root, {clientWidth: 1000, clientHeight: 700});
// A line's own values; of a point under the diagram's edge the edge.
svg.send("pointermove", 395, 91.5);
assert(tip.textContent.endsWith("error, m: 0.25 at 31.62"), tip.textContent);
svg.send("pointermove", 402, 270);
assert(tip.textContent.endsWith("error, m: 0.5 at under 1"), tip.textContent);
svg.send("pointermove", 5, 5);
assert.strictEqual(tip.hidden, true);
// Far from every point of the line it has no value.
svg.send("pointermove", 170, 153);
assert(!tip.textContent.includes("run"), tip.textContent);
// A dragged rectangle fills the diagram: x 50 .. 75, y 10 .. 31.6.
svg.send("pointerdown", 284, 153);
svg.send("pointermove", 395, 91.5);
svg.send("pointerup", 395, 91.5);
assert.deepStrictEqual(area.getAttribute("viewBox").split(" ").map(Number), [284, 91.5, 111, 61.5]);
const words = ticks.children.filter(c => c.name === "text").map(c => c.textContent);
assert(words.includes("50") && words.includes("75") && words.includes("20"), words.join());
assert(!words.includes("100"), words.join());
// A label stays at its place, in its size.
assert.strictEqual(label.getAttribute("transform"), "matrix(0.25 0 0 0.25 75 150)");
svg.send("pointermove", 62, 276);  // the corner is the rectangle's
assert(tip.textContent.startsWith("x 50   y 10"), tip.textContent);
svg.listeners.dblclick();
assert.strictEqual(area.getAttribute("viewBox"), "62 30 444 246");
assert.deepStrictEqual(ticks.children, ["as drawn"]);
assert.strictEqual(label.getAttribute("transform"), "matrix(1 0 0 1 0 0)");
// A drag that ends outside takes all up to the edge.
svg.send("pointerdown", 284, 153);
assert.strictEqual(svg.captured, 7);
svg.send("pointermove", 600, 900);
assert.strictEqual(tip.hidden, false);
svg.send("pointerup", 600, 900);
assert.strictEqual(area.getAttribute("viewBox"), "284 153 222 123");
svg.listeners.dblclick();
// What is taken away from the page while a drag is on ends it.
svg.send("pointerdown", 284, 153);
svg.listeners.pointercancel();
svg.send("pointerup", 395, 250);
assert.strictEqual(area.getAttribute("viewBox"), "62 30 444 246");
// A click is no zoom.
svg.send("pointerdown", 284, 153);
svg.send("pointerup", 285, 153);
assert.strictEqual(area.getAttribute("viewBox"), "62 30 444 246");
// Of lengths a flat rectangle is widened to the diagram's shape.
svg.dataset.equal = "1";
svg.send("pointerdown", 284, 153);
svg.send("pointerup", 395, 150);
const [, , w, h] = area.getAttribute("viewBox").split(" ").map(Number);
assert(Math.abs(w / h - 444 / 246) < 1e-6, w + " " + h);
)JS";

TEST(Script, StandsInThePageAsItIs) {
  const std::string script = page_script();
  EXPECT_EQ(script.find('<'), std::string::npos);
  for (const char* part : {"http", "fetch(", "XMLHttp", "import ", "eval("})
    EXPECT_EQ(script.find(part), std::string::npos) << part;
}

TEST(Script, ShowsValuesAndZooms) {
  if (run_shell("node --version").status != 0) GTEST_SKIP() << "needs Node";
  const ScratchFolder folder;
  put(folder / "page.js", std::string(kPage) + page_script() + kCheck);
  const ProgramResult result = run_shell("node " + (folder / "page.js").string());
  EXPECT_EQ(result.status, 0) << result.err;
}

}  // namespace
}  // namespace farpoint::tools::report
