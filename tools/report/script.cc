// SPDX-License-Identifier: Apache-2.0
#include "tools/report/script.h"

namespace farpoint::tools::report {

const char* page_script() {
  return R"JS(
"use strict";
(() => {
const far_px = 24;                       // a line further from the pointer has no value there

// ---- numbers and axes
const text = v => {
  const size = Math.abs(v);
  if (size === 0) return "0";
  return size >= 1e6 || 1e-4 > size ? v.toExponential(2) : String(Number(v.toPrecision(5)));
};
const steps = (low, high, wanted) => {
  const raw = (high - low) / wanted, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = power * ([1, 2, 5].find(m => m * power >= raw) || 10), out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; high + 1e-9 * step >= v && 40 > out.length; v += step)
    out.push(1e-9 * step > Math.abs(v) ? 0 : v);
  return out;
};
const ticks = (low, high, wanted, isLog) => {
  if (!isLog) return steps(low, high, wanted);
  const out = [];
  for (let decade = Math.pow(10, Math.floor(Math.log10(low))); high >= decade; decade *= 10)
    for (const m of high / low > 2e3 ? [1] : [1, 2, 5])
      if (m * decade >= 0.999 * low && 1.001 * high >= m * decade) out.push(m * decade);
  if (out.length >= 4) return out;
  const room = Math.log(high / low) / (2 * wanted), apart = [];
  for (const v of steps(low, high, 2 * wanted))
    if (!apart.length || Math.log(v / apart[apart.length - 1]) >= room) apart.push(v);
  return apart;
};
const axisOf = (words, from, to) => {
  const [a, b, kind] = words.split(" "), low = Number(a), high = Number(b), isLog = kind === "log";
  const at = v => isLog ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low);
  return {
    isLog,
    value: px => {
      const share = (px - from) / (to - from);
      return isLog ? low * Math.pow(high / low, share) : low + share * (high - low);
    },
    pixel: v => from + at(v) * (to - from)
  };
};

// ---- one diagram
const tip = document.body.appendChild(document.createElement("div"));
tip.className = "tip";
tip.hidden = true;

const chartOf = svg => {
  const area = svg.querySelector("svg.area"), group = svg.querySelector("g.ticks");
  const box = {x: Number(area.getAttribute("x")), y: Number(area.getAttribute("y")),
               w: Number(area.getAttribute("width")), h: Number(area.getAttribute("height"))};
  const x = axisOf(svg.dataset.x, box.x, box.x + box.w), y = axisOf(svg.dataset.y, box.y + box.h, box.y);
  const view = {...box}, whole = group.cloneNode(true);
  const make = (parent, name, attributes) => {
    const element = document.createElementNS(svg.namespaceURI, name);
    for (const key of Object.keys(attributes)) element.setAttribute(key, attributes[key]);
    return parent.appendChild(element);
  };
  const cursor = make(area, "line", {class: "cursor", visibility: "hidden"});
  const frame = make(area, "rect", {class: "chosen", visibility: "hidden"});
  const lines = [];
  for (const polyline of area.querySelectorAll("polyline[data-name]")) {
    const name = polyline.getAttribute("data-name");
    if (!name) continue;
    let line = lines.find(known => known.name === name);
    if (!line) lines.push(line = {name, points: []});
    for (const pair of polyline.getAttribute("points").trim().split(" "))
      line.points.push(pair.split(",").map(Number));
  }

  // Pixels of the unzoomed diagram under the pointer.
  const pointOf = event => {
    const seen = svg.getBoundingClientRect(), width = Number(svg.getAttribute("width"));
    const u = (event.clientX - seen.left) * width / seen.width, v = (event.clientY - seen.top) * width / seen.width;
    const inside = u >= box.x && box.x + box.w >= u && v >= box.y && box.y + box.h >= v;
    return {inside, x: view.x + (u - box.x) * view.w / box.w, y: view.y + (v - box.y) * view.h / box.h};
  };

  const drawTicks = () => {
    group.replaceChildren();
    const left = x.value(view.x), right = x.value(view.x + view.w);
    const low = y.value(view.y + view.h), high = y.value(view.y), bottom = box.y + box.h;
    for (const v of ticks(left, right, 7, x.isLog)) {
      const at = box.x + (x.pixel(v) - view.x) * box.w / view.w;
      make(group, "line", {x1: at, y1: box.y, x2: at, y2: bottom, class: "grid"});
      make(group, "text", {x: at, y: bottom + 15, "text-anchor": "middle"}).textContent = text(v);
    }
    for (const v of ticks(low, high, 6, y.isLog)) {
      const at = box.y + (y.pixel(v) - view.y) * box.h / view.h;
      make(group, "line", {x1: box.x, y1: at, x2: box.x + box.w, y2: at, class: "grid"});
      make(group, "text", {x: box.x - 6, y: at + 4, "text-anchor": "end"}).textContent = text(v);
    }
  };
  const zoomTo = to => {
    Object.assign(view, to);
    area.setAttribute("viewBox", [view.x, view.y, view.w, view.h].join(" "));
    drawTicks();
  };
  const reset = () => {
    Object.assign(view, box);
    area.setAttribute("viewBox", [box.x, box.y, box.w, box.h].join(" "));
    group.replaceChildren(...whole.cloneNode(true).childNodes);
  };

  // Of each line the point nearest in x, or in the plane where both axes are lengths.
  const nearest = (line, at) => {
    let best = null, least = Infinity;
    for (const p of line.points) {
      const dx = (p[0] - at.x) * box.w / view.w, dy = (p[1] - at.y) * box.h / view.h;
      const distance = svg.dataset.equal ? Math.hypot(dx, dy) : Math.abs(dx) + 1e-3 * Math.abs(dy);
      if (least > distance) { least = distance; best = p; }
    }
    return far_px > least ? best : null;
  };
  const show = (event, at) => {
    const words = ["x " + text(x.value(at.x)) + "   y " + text(y.value(at.y))];
    for (const line of lines) {
      const p = nearest(line, at);
      if (!p) continue;
      words.push(line.name + ": " + (svg.dataset.equal ? text(x.value(p[0])) + ", " : "") + text(y.value(p[1])));
    }
    tip.textContent = words.join("\n");
    tip.style.left = Math.min(event.pageX + 14, window.scrollX + window.innerWidth - 260) + "px";
    tip.style.top = event.pageY + 14 + "px";
    tip.hidden = false;
    for (const [key, v] of [["x1", at.x], ["x2", at.x], ["y1", view.y], ["y2", view.y + view.h]])
      cursor.setAttribute(key, v);
    cursor.setAttribute("visibility", "visible");
  };
  const hide = () => {
    tip.hidden = true;
    cursor.setAttribute("visibility", "hidden");
  };

  // ---- zoom: the chosen rectangle; of lengths widened to the diagram's shape
  let from = null;
  const chosen = to => {
    const r = {x: Math.min(from.x, to.x), y: Math.min(from.y, to.y),
               w: Math.abs(to.x - from.x), h: Math.abs(to.y - from.y)};
    if (!svg.dataset.equal) return r;
    const factor = Math.max(r.w / box.w, r.h / box.h);
    return {x: r.x + 0.5 * (r.w - factor * box.w), y: r.y + 0.5 * (r.h - factor * box.h),
            w: factor * box.w, h: factor * box.h};
  };
  svg.addEventListener("pointerdown", event => {
    const at = pointOf(event);
    if (event.button !== 0 || !at.inside) return;
    event.preventDefault();
    from = at;
  });
  svg.addEventListener("pointermove", event => {
    const at = pointOf(event);
    if (!at.inside) return hide();
    show(event, at);
    if (!from) return;
    const r = chosen(at);
    for (const [key, v] of [["x", r.x], ["y", r.y], ["width", r.w], ["height", r.h]]) frame.setAttribute(key, v);
    frame.setAttribute("visibility", "visible");
  });
  svg.addEventListener("pointerup", event => {
    if (!from) return;
    const r = chosen(pointOf(event));
    from = null;
    frame.setAttribute("visibility", "hidden");
    if (r.w > view.w / 60 && r.h > view.h / 60) zoomTo(r);
  });
  svg.addEventListener("pointerleave", () => {
    from = null;
    frame.setAttribute("visibility", "hidden");
    hide();
  });
  svg.addEventListener("dblclick", reset);
};

for (const svg of document.querySelectorAll("svg[data-x]")) chartOf(svg);
const hint = document.getElementById("hint");
if (hint) hint.textContent = "Drag over a diagram to zoom, double-click for the whole. The pointer shows values.";
})();
)JS";
}

}  // namespace farpoint::tools::report
