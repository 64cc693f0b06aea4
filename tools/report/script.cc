// SPDX-License-Identifier: Apache-2.0
#include "tools/report/script.h"

namespace farpoint::tools::report {

const char* page_script() {
  return R"JS(
"use strict";
(() => {
const far_px = 10;                       // a line further from the pointer has no value there

// ---- numbers and axes
// finest: what the drawing can tell apart; digits beyond it are left out.
const text = (v, finest = 0) => {
  if (finest > 0) {
    const unit = Math.pow(10, Math.ceil(Math.log10(finest) - 1e-9));
    v = 1 > unit ? Math.round(v / unit) * unit : Math.round(v);
  }
  const size = Math.abs(v);
  if (1e-300 > size) return "0";
  return size >= 1e7 || 1e-4 > size ? v.toExponential(2) : String(Number(v.toPrecision(6)));
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
    pixel: v => from + at(v) * (to - from),
    // The value at a point of the drawing, which has hundredths of a pixel; at the end where that is passed.
    words(px) {
      const first = Math.min(from, to), last = Math.max(from, to), bound = Math.min(Math.max(px, first), last);
      const finest = Math.abs(this.value(bound + 0.005) - this.value(bound - 0.005));
      const outside = bound === px ? "" : (px - bound) * (to - from) > 0 ? "over " : "under ";
      return outside + text(this.value(bound), finest);
    }
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
  // Else the browser shows the title over the values.
  const title = svg.querySelector("title");
  if (title) {
    svg.setAttribute("aria-label", title.textContent);
    title.remove();
  }
  const cursor = make(area, "line", {class: "cursor", visibility: "hidden"});
  const frame = make(area, "rect", {class: "chosen", visibility: "hidden"});
  const lines = [];
  for (const polyline of area.querySelectorAll("polyline[data-name]")) {
    const name = polyline.getAttribute("data-name");
    if (!name) continue;
    let line = lines.find(known => known.name === name);
    if (!line) lines.push(line = {name, points: []});
    const values = (polyline.getAttribute("data-values") || "").split(" ");
    for (const [i, pair] of polyline.getAttribute("points").trim().split(" ").entries())
      line.points.push([...pair.split(",").map(Number), values[i]]);
  }
  const labels = [...area.querySelectorAll("g.label")].map(element => {
    const [u, v] = element.getAttribute("data-at").split(",").map(Number);
    return {element, u, v};
  });

  // Pixels of the unzoomed diagram under the pointer; of one outside the nearest inside.
  const pointOf = event => {
    const seen = svg.getBoundingClientRect(), width = Number(svg.getAttribute("width"));
    const u = (event.clientX - seen.left) * width / seen.width, v = (event.clientY - seen.top) * width / seen.width;
    const p = Math.min(Math.max(u, box.x), box.x + box.w), q = Math.min(Math.max(v, box.y), box.y + box.h);
    return {inside: p === u && q === v,
            x: view.x + (p - box.x) * view.w / box.w, y: view.y + (q - box.y) * view.h / box.h};
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
  const viewAs = to => {
    Object.assign(view, to);
    area.setAttribute("viewBox", [view.x, view.y, view.w, view.h].join(" "));
    // Words and rings keep their size.
    const a = view.w / box.w, d = view.h / box.h;
    for (const {element, u, v} of labels)
      element.setAttribute("transform", `matrix(${a} 0 0 ${d} ${u - a * u} ${v - d * v})`);
  };
  const zoomTo = to => {
    viewAs(to);
    drawTicks();
  };
  const reset = () => {
    viewAs(box);
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
  const wordsOf = p => {
    const place = svg.dataset.equal ? x.words(p[0]) + ", " + y.words(p[1]) : y.words(p[1]);
    return p[2] ? p[2] + " at " + place : place;
  };
  const show = (event, at) => {
    const words = ["x " + x.words(at.x) + "   y " + y.words(at.y)];
    for (const line of lines) {
      const p = nearest(line, at);
      if (p) words.push(line.name + ": " + wordsOf(p));
    }
    tip.textContent = words.join("\n");
    tip.hidden = false;
    // Beside the pointer, on its other side where the window ends.
    const w = tip.offsetWidth, h = tip.offsetHeight, root = document.documentElement;
    const isRight = root.clientWidth >= event.clientX + 14 + w, isBelow = root.clientHeight >= event.clientY + 14 + h;
    tip.style.left = Math.max(event.pageX + (isRight ? 14 : -14 - w), window.scrollX) + "px";
    tip.style.top = Math.max(event.pageY + (isBelow ? 14 : -14 - h), window.scrollY) + "px";
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
  const release = () => {
    from = null;
    frame.setAttribute("visibility", "hidden");
  };
  svg.addEventListener("pointerdown", event => {
    const at = pointOf(event);
    if (event.button !== 0 || !at.inside) return;
    event.preventDefault();
    svg.setPointerCapture(event.pointerId);  // a drag may end anywhere
    from = at;
  });
  svg.addEventListener("pointermove", event => {
    const at = pointOf(event);
    if (!at.inside && !from) return hide();
    show(event, at);
    if (!from) return;
    const r = chosen(at);
    for (const [key, v] of [["x", r.x], ["y", r.y], ["width", r.w], ["height", r.h]]) frame.setAttribute(key, v);
    frame.setAttribute("visibility", "visible");
  });
  svg.addEventListener("pointerup", event => {
    if (!from) return;
    const r = chosen(pointOf(event));
    release();
    if (r.w > view.w / 60 && r.h > view.h / 60) zoomTo(r);
  });
  for (const end of ["pointerleave", "pointercancel"])
    svg.addEventListener(end, () => {
      release();
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
