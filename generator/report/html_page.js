"use strict";
// Draws the report from the JSON in the page. All text enters as text nodes, never as markup.

const sets = JSON.parse(document.getElementById("data").textContent);
const keys = ["a", "b"];
const SVG = "http://www.w3.org/2000/svg";
const number = (value, digits = 0) =>
  value.toLocaleString("en", { maximumFractionDigits: digits, minimumFractionDigits: 0 });
const short = (value) =>
  value === 0 ? "0" : Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3 ? value.toExponential(1)
    : String(Number(value.toPrecision(3)));
const percent = (share) => `${number(100 * share, share < 0.1 ? 2 : 1)} %`;
const many = (count, noun) => `${number(count)} ${noun}${count === 1 ? "" : "s"}`;
const size = (bytes) => (bytes < 1e9 ? `${short(bytes / 1e6)} MB` : `${number(bytes / 1e9, 1)} GB`);
const sum = (values) => values.reduce((total, value) => total + value, 0);

/** An HTML element with attributes, event listeners (functions) and children. */
function el(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

function svg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") node.addEventListener(name, value);
    else if (value !== null && value !== undefined && value !== false) node.setAttribute(name, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

// ---------------------------------------------------------------- charts

/**
 * Histogram as SVG.
 * edges: of the bins, or null; names: of the bars instead.
 * series: [{key, values, shares}]: bars side by side, heights in proportion to shares.
 * lines: [{key, shares}]: declared shares, as a stepped line.
 */
function histogram({ label, edges, names, series, lines = [], unit = "objects" }) {
  const [width, height, bottom] = [340, 110, 18];
  const count = edges ? edges.length - 1 : names.length;
  const all = [...series, ...lines].flatMap((row) => row.shares);
  const top = Math.max(...all, 1e-9);
  const step = width / count;
  const image = svg("svg", {
    viewBox: `0 0 ${width} ${height + bottom}`, role: "img", "aria-label": label,
  });
  const bar = (0.86 * step) / series.length;
  series.forEach((row, order) => {
    row.shares.forEach((share, k) => {
      const tall = (height * share) / top;
      const range = edges ? `${short(edges[k])} to ${short(edges[k + 1])}` : names[k];
      const text = `${range}: ${number(row.values[k])} ${unit}, ${percent(share)}`;
      const x = k * step + 0.07 * step + order * bar;
      image.append(svg("rect", {
        class: row.key, x: x.toFixed(1), y: (height - tall).toFixed(1), width: bar.toFixed(2),
        height: tall.toFixed(1), rx: 1,
      }, svg("title", {}, sets.length > 1 ? `${sets[keys.indexOf(row.key)].name}: ${text}` : text)));
    });
  });
  for (const row of lines) {
    const points = row.shares.flatMap((share, k) => {
      const y = (height - (height * share) / top).toFixed(1);
      return [`${(k * step).toFixed(1)},${y}`, `${((k + 1) * step).toFixed(1)},${y}`];
    });
    image.append(svg("polyline", { points: points.join(" ") }));
  }
  image.append(svg("line", { class: "axis", x1: 0, x2: width, y1: height + 0.5, y2: height + 0.5 }));
  if (edges) {
    const every = Math.ceil(count / 7);
    const ticks = Array.from({ length: count }, (_, k) => k).filter((k) => k % every === 0 && count - k >= 0.8 * every);
    for (const k of [...ticks, count]) {
      const anchor = k === 0 ? "start" : k === count ? "end" : "middle";
      image.append(svg("text", { x: k * step, y: height + 13, "text-anchor": anchor }, short(edges[k])));
    }
  } else {
    const letters = Math.floor(step / 5.2);
    names.forEach((name, k) => {
      if (letters < 2 && k % Math.ceil(12 / step)) return;
      const shown = name.length > letters && letters > 1 ? `${name.slice(0, letters - 1)}…` : name;
      image.append(svg("text", { x: (k + 0.5) * step, y: height + 13, "text-anchor": "middle" },
        shown, svg("title", {}, name)));
    });
  }
  return image;
}

/** Horizontal bars, one row per name; every data set has a bar in each row. */
function rows(names, series, format, unit) {
  const top = Math.max(...series.flatMap((row) => row.shares), 1e-9);
  const table = el("div", { class: "names" });
  names.forEach((name, k) => {
    const bars = svg("svg", { viewBox: "0 0 100 10", preserveAspectRatio: "none", role: "img",
      "aria-label": `${name}: ${series.map((row) => format(row.values[k])).join(", ")} ${unit}` });
    const tall = 9 / series.length;
    series.forEach((row, order) => bars.append(svg("rect", { class: row.key, x: 0, y: 0.5 + order * tall,
      width: Math.max((100 * row.shares[k]) / top, row.values[k] ? 0.4 : 0), height: tall })));
    table.append(el("span", { title: name }, name), bars,
      el("span", {}, series.map((row) => format(row.values[k])).join(" | ")));
  });
  return table;
}

const shares = (values) => {
  const total = sum(values) || 1;
  return values.map((value) => value / total);
};

const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

/** Histograms of the same title of all sets: in one chart where their bins agree. */
function compared(title, found, unit) {
  const charts = found.filter((item) => item.histogram).map(({ key, histogram: made, values }) => ({
    edges: made.edges, row: { key, values, shares: shares(values) },
  }));
  const groups = [];
  for (const chart of charts) {
    const group = groups.find((other) => same(other[0].edges, chart.edges));
    if (group) group.push(chart);
    else groups.push([chart]);
  }
  return el("div", { class: "card" }, el("h3", {}, title),
    ...groups.map((group) => histogram({
      label: title, edges: group[0].edges, series: group.map((chart) => chart.row), unit,
    })));
}

// ---------------------------------------------------------------- parts of the page

function legend() {
  return sets.length < 2 ? null : el("div", { class: "legend" },
    ...sets.map((set, k) => el("span", {}, el("i", { class: keys[k] }), set.name)));
}

function section(id, title, note, ...content) {
  const shown = content.filter((child) => child);
  if (!shown.length) return null;
  return el("section", { id }, el("h2", {}, title), note ? el("p", { class: "quiet" }, note) : null, ...shown);
}

function table(header, body, { text = [], picked = null } = {}) {
  const kind = (k) => (text.includes(k) ? { class: "text" } : {});
  return el("div", { class: "scroll" }, el("table", {},
    el("thead", {}, el("tr", {}, ...header.map((cell, k) => el("th", kind(k), cell)))),
    el("tbody", {}, ...body.map((row, number) => el("tr",
      picked ? { class: "pick", tabindex: 0, click: () => picked(number), focus: () => picked(number) } : {},
      ...row.map((cell, k) => el("td", kind(k), cell)))))));
}

function options(names, label, change) {
  const list = el("select", { "aria-label": label, change: () => change(list.value) },
    ...names.map(([value, text]) => el("option", { value }, text)));
  return list;
}

/** Select a category, or all together, for a group of charts. */
function byCategory(names, draw) {
  const place = el("div");
  const show = (name) => place.replaceChildren(draw(name));
  show("");
  const choices = [["", "all"], ...names.map((name) => [name, name])];
  return el("div", {}, el("div", { class: "bar" },
    el("label", {}, "Category", options(choices, "Category of the charts", show))), place);
}

function tile(value, text, kind = "") {
  return el("div", { class: "tile" }, el("b", { class: kind }, value), el("span", {}, text));
}

function overview(set, k) {
  const about = set.about;
  const findings = set.checks ? sum(set.checks.map((check) => check.found)) : 0;
  const outside = (set.parameters || []).filter((row) => row.deviation > row.limit).length;
  const tiles = [
    about ? tile(number(about.samples), "samples") : null,
    about ? tile(number(about.scenes), "scenes") : null,
    tile(number(set.counts.images), "images"),
    tile(number(set.counts.objects), "labelled objects"),
    about ? tile(size(about.bytes), "on disk") : null,
    set.checks ? tile(number(findings), "contradictions of labels", findings ? "bad" : "good") : null,
    set.duplicates ? tile(number(set.duplicates.groups), "groups of near-duplicates",
      set.duplicates.groups ? "bad" : "good") : null,
    about ? tile(number(set.rejected_layouts), "rejected layouts") : null,
    (set.parameters || []).length ? tile(number(outside), `of ${set.parameters.length} parameters stand out`,
      outside ? "bad" : "good") : null,
  ];
  const splits = Object.entries(set.splits).map(([name, n]) => `${name} ${number(n)}`).join(", ");
  const facts = about ? [
    `${about.configuration}${about.template && about.template !== about.configuration ? `, template ${about.template}` : ""}, seed ${about.seed}`,
    `${many(about.views_per_scene, "view")} and ${many(about.steps_per_scene, "step")} per scene`,
    `images: ${splits}`, about.sensors.join("; "), `gen-data ${about.version}`,
    `id ${about.dataset_id.slice(0, 16)}`,
  ] : [`images: ${splits}`];
  return el("div", {}, el("h1", {}, sets.length > 1 ? el("i", { class: keys[k] }) : null, set.name),
    el("p", { class: "quiet" }, facts.join(" · ")),
    el("div", { class: "tiles" }, ...tiles.filter((item) => item)));
}

function balance() {
  if (!sets.every((set) => set.categories)) return null;
  const names = [...new Set(sets.flatMap((set) => set.categories.map((row) => row.name)))];
  const count = (set, name, field) => {
    const row = set.categories.find((item) => item.name === name);
    return row ? row[field] : 0;
  };
  const order = names.sort((x, y) => count(sets[0], y, "objects") - count(sets[0], x, "objects"));
  const draw = (field, title) => {
    const series = sets.map((set, k) => {
      const values = order.map((name) => count(set, name, field));
      return { key: keys[k], values, shares: field === "objects" ? shares(values)
        : values.map((value) => value / Math.max(set.counts.images, 1)) };
    });
    return el("div", { class: "card" }, el("h3", {}, title), rows(order, series, number, field));
  };
  return el("div", { class: "grid" }, draw("objects", "Objects by category"),
    draw("images", "Images with the category"));
}

function objectCharts() {
  const titles = [...new Set(sets.flatMap((set) =>
    [...set.histograms, ...(set.labels || [])].map((made) => made.title)))];
  const names = [...new Set(sets.flatMap((set) => (set.categories || []).filter((row) => row.objects)
    .map((row) => row.name)))];
  if (!names.length) {
    names.push(...new Set(sets.flatMap((set) => set.histograms.flatMap((made) => Object.keys(made.counts)))));
  }
  const draw = (category) => el("div", { class: "grid" }, ...titles.map((title) => {
    const found = sets.map((set, k) => {
      const made = [...set.histograms, ...(set.labels || [])].find((item) => item.title === title);
      if (!made) return { key: keys[k], histogram: null };
      const perImage = "images" in made.counts && Object.keys(made.counts).length === 1;
      const empty = made.edges.slice(1).map(() => 0);
      const chosen = category && !perImage ? [made.counts[category] || empty] : Object.values(made.counts);
      return { key: keys[k], histogram: made,
        values: empty.map((_, bin) => sum(chosen.map((counts) => counts[bin]))) };
    });
    return compared(title, found, title.includes("per image") ? "images" : "objects");
  }));
  return byCategory(names, draw);
}

/** Directions of the camera around objects: a map whose cells have equal areas. */
function viewpointMap(set, k, category) {
  const { azimuths, elevations, counts } = set.viewpoints;
  const chosen = category ? [counts[category]].filter((item) => item) : Object.values(counts);
  const total = Array.from({ length: azimuths }, (_, i) => Array.from({ length: elevations },
    (_, j) => sum(chosen.map((cells) => cells[i][j]))));
  const top = Math.max(...total.flat(), 1);
  const filled = total.flat().filter((n) => n).length;
  const [width, height] = [360, 180];
  const title = category || "All categories";
  const image = svg("svg", { viewBox: `-26 -4 ${width + 32} ${height + 26}`, role: "img",
    "aria-label": `Viewpoints: ${title}` });
  image.append(svg("rect", { class: `soft ${keys[k]}`, opacity: 0.25, x: 0, y: 0, width, height }));
  const degreesAt = (row) => Math.round((Math.asin(-1 + (2 * row) / elevations) * 180) / Math.PI);
  total.forEach((column, i) => column.forEach((n, j) => {
    if (!n) return;
    const west = -180 + (360 * i) / azimuths;
    const text = `azimuth ${west} to ${west + 360 / azimuths}°, elevation ${degreesAt(j)} to ${degreesAt(j + 1)}°: ${number(n)} objects`;
    image.append(svg("rect", { class: keys[k], opacity: (0.18 + 0.82 * Math.sqrt(n / top)).toFixed(3),
      x: (width * i) / azimuths, y: height - (height * (j + 1)) / elevations,
      width: width / azimuths - 0.6, height: height / elevations - 0.6 }, svg("title", {}, text)));
  }));
  for (const degrees of [-180, -90, 0, 90, 180]) {
    image.append(svg("text", { x: (width * (degrees + 180)) / 360, y: height + 14, "text-anchor": "middle" }, `${degrees}°`));
  }
  for (const degrees of [-60, -30, 0, 30, 60]) {
    const y = height * (0.5 - 0.5 * Math.sin((degrees * Math.PI) / 180));
    image.append(svg("line", { class: "axis", x1: 0, x2: width, y1: y, y2: y }),
      svg("text", { x: -4, y: y + 3, "text-anchor": "end" }, `${degrees}°`));
  }
  return el("div", { class: "card" },
    el("h3", {}, sets.length > 1 ? el("i", { class: `key ${keys[k]}` }) : null, title), image,
    el("p", { class: "quiet" }, `${number(sum(total.flat()))} objects; ${percent(filled / (azimuths * elevations))} of the sphere seen`));
}

const MAPS = 6;

function viewpoints() {
  const known = sets.map((set, k) => ({ set, k })).filter(({ set }) =>
    set.viewpoints && Object.keys(set.viewpoints.counts).length);
  if (!known.length) return null;
  const seen = (name) => sum(known.flatMap(({ set }) => (set.viewpoints.counts[name] || []).map(sum)));
  const names = [...new Set(known.flatMap(({ set }) => Object.keys(set.viewpoints.counts)))];
  const frequent = [...names].sort((x, y) => seen(y) - seen(x)).slice(0, Math.floor(MAPS / known.length) - 1);
  return byCategory(names, (category) => el("div", { class: "grid" },
    ...(category ? [category] : ["", ...frequent]).flatMap((name) =>
      known.map(({ set, k }) => viewpointMap(set, k, name)))));
}

function imageCharts() {
  const titles = [...new Set(sets.flatMap((set) => (set.images || [])
    .filter((made) => Object.keys(made.counts).length).map((made) => made.title)))];
  if (!titles.length) return null;
  return el("div", { class: "grid" }, ...titles.map((title) => compared(title, sets.map((set, k) => {
    const made = (set.images || []).find((item) => item.title === title);
    if (!made) return { key: keys[k], histogram: null };
    const columns = Object.values(made.counts);
    return { key: keys[k], histogram: made,
      values: made.edges.slice(1).map((_, bin) => sum(columns.map((counts) => counts[bin]))) };
  }), "images")));
}

const CARDS = 12;

function parameters() {
  const names = [...new Set(sets.flatMap((set) => (set.parameters || []).map((row) => row.name)))].sort();
  const notes = sets.filter((set) => set.parameters_note).map((set) =>
    el("p", { class: "quiet" }, sets.length > 1 ? `${set.name}: ${set.parameters_note}` : set.parameters_note));
  if (!names.length) return notes.length ? el("div", {}, ...notes) : null;
  const cards = names.map((name) => {
    const found = sets.map((set, k) => ({ k, row: (set.parameters || []).find((row) => row.name === name) }))
      .filter(({ row }) => row);
    const stands = found.some(({ row }) => row.deviation > row.limit);
    const groups = [];
    for (const one of found) {
      const group = groups.find(([other]) => same(other.row.edges, one.row.edges)
        && same(other.row.names, one.row.names) && same(Object.keys(other.row.declared), Object.keys(one.row.declared)));
      if (group) group.push(one);
      else groups.push([one]);
    }
    const charts = groups.flatMap((group) => [
      histogram({ label: name, edges: group[0].row.edges, names: group[0].row.names, unit: "draws",
        series: group.map(({ k, row }) => ({ key: keys[k], values: row.drawn, shares: shares(row.drawn) })),
        lines: [{ shares: group[0].row.expected }] }),
      el("div", {}, ...Object.keys(group[0].row.declared).slice(0, 4).flatMap((text) => [el("code", {}, text), el("br")]),
        ...group.map(({ k, row }) => el("div", { class: "quiet" }, sets.length > 1 ? el("i", { class: `key ${keys[k]}` }) : null,
          `${number(row.draws)} draws, largest difference ${percent(row.deviation)} `,
          row.deviation > row.limit ? el("span", { class: "flag" }, `stands out (over ${percent(row.limit)})`) : null))),
    ]);
    const card = el("div", { class: "card parameter" }, el("h3", {}, name), ...charts);
    return { name, stands, card };
  });
  const search = el("input", { type: "search", placeholder: "Filter by name", "aria-label": "Filter parameters",
    input: () => show() });
  const only = el("button", { "aria-pressed": "false", click: () => {
    only.setAttribute("aria-pressed", String(only.getAttribute("aria-pressed") !== "true"));
    show();
  } }, "Only those that stand out");
  const more = el("button", { click: () => {
    more.remove();
    show();
  } }, `Show all ${cards.length}`);
  const show = () => {
    const unusual = only.getAttribute("aria-pressed") === "true";
    const wanted = cards.filter(({ name, stands }) =>
      name.toLowerCase().includes(search.value.toLowerCase()) && (stands || !unusual));
    const whole = unusual || search.value || !more.parentElement;
    more.hidden = Boolean(whole);
    // Outliers come first among the few that are shown at once.
    const first = whole ? wanted : [...wanted].sort((x, y) => y.stands - x.stands).slice(0, CARDS);
    for (const item of cards) item.card.hidden = !first.includes(item);
  };
  const whole = el("div", {}, ...notes, el("div", { class: "bar" }, search, only),
    el("div", { class: "grid" }, ...cards.map(({ card }) => card)), el("div", { class: "bar" }, more));
  if (cards.length <= CARDS) more.remove();
  show();
  return whole;
}

function checks() {
  const known = sets.filter((set) => set.checks);
  if (!known.length) return null;
  return el("div", { class: "grid wide" }, ...known.map((set) => el("div", { class: "card" },
    el("h3", {}, sets.length > 1 ? set.name : "Labels that contradict each other"),
    ...set.checks.map((check) => {
      const state = !check.checked ? ["quiet", "not annotated"]
        : check.found ? ["bad", `${number(check.found)} of ${number(check.checked)}`]
          : ["good", `none of ${number(check.checked)}`];
      const line = el(check.found ? "summary" : "div", { class: "check" }, el("span", {}, check.title),
        el("span", { class: state[0] }, state[1]));
      if (!check.found) return line;
      return el("details", {}, line, table(["image", "object", "finding"], check.examples.map((item) => [
        `${item.index} ${item.camera}`, `${item.category} ${item.instance_id}`, item.fact]), { text: [1, 2] }));
    }))));
}

function duplicates() {
  const known = sets.filter((set) => set.duplicates && set.duplicates.images);
  if (!known.length) return null;
  return el("div", { class: "grid" }, ...known.map((set) => {
    const found = set.duplicates;
    return el("div", { class: "card" }, el("h3", {}, sets.length > 1 ? set.name : "Images that look alike"),
      el("p", { class: found.groups ? "bad" : "good" }, found.groups
        ? `${number(found.grouped)} of ${number(found.images)} images in ${number(found.groups)} groups`
        : `none among ${number(found.images)} images`),
      ...found.shown.map((group) => el("details", {}, el("summary", {},
        `${group.images} images of ${group.scenes} scenes `,
        group.splits.length > 1 ? el("span", { class: "flag" }, `in ${group.splits.join(" and ")}`) : null),
      el("div", { class: "thumbs" }, ...group.members.map((item) => el("figure", {},
        item.picture ? el("img", { src: item.picture, alt: "", loading: "lazy" }) : null,
        `${item.index} ${item.camera}`))))));
  }));
}

function costs() {
  const known = sets.map((set, k) => ({ set, k })).filter(({ set }) => set.about);
  if (!known.length) return null;
  const cards = [];
  const stages = [...new Set(known.flatMap(({ set }) => Object.keys(set.timings)))];
  if (stages.length) {
    const series = known.map(({ set, k }) => {
      const values = stages.map((name) => set.timings[name] || 0);
      return { key: keys[k], values, shares: values };
    });
    cards.push(el("div", { class: "card" }, el("h3", {}, "CPU seconds per sample, by stage"),
      rows(stages, series, (value) => short(value), "s"),
      el("p", { class: "quiet" }, `In all: ${series.map((row) => short(sum(row.values))).join(" | ")} s`)));
  }
  for (const { set } of known) {
    const body = set.rejections.map((row) => [row.reason, number(row.count), row.remedy]);
    cards.push(el("div", { class: "card" },
      el("h3", {}, sets.length > 1 ? `Rejected layouts: ${set.name}` : "Rejected layouts"),
      el("p", { class: "quiet" }, `${number(set.rejected_layouts)} in the data set` + (body.length
        ? "; reasons in the scenes that were drawn again:" : "")),
      body.length ? table(["reason", "attempts", "remedy"], body, { text: [0, 2] }) : null));
  }
  return el("div", { class: "grid" }, ...cards);
}

function tables() {
  const titles = [...new Set(sets.flatMap((set) => set.tables.map((made) => made.title)))];
  return el("div", {}, ...titles.map((title, k) => el("details", k ? {} : { open: "" }, el("summary", {}, title),
    ...sets.flatMap((set) => set.tables.filter((made) => made.title === title).map((made) =>
      el("div", { class: "card" }, sets.length > 1 ? el("h3", {}, set.name) : null,
        table(made.header, made.rows), made.note ? el("p", { class: "quiet" }, made.note) : null))))));
}

function licences() {
  const known = sets.filter((set) => set.licences && set.licences.length);
  if (!known.length) return null;
  return el("div", { class: "grid wide" }, ...known.map((set) => el("div", { class: "card" },
    sets.length > 1 ? el("h3", {}, set.name) : null,
    ...set.licences.map((row) => {
      const assets = row.assets.split(", ");
      return el("div", { class: "licence" }, el("strong", {}, row.licence), `: ${row.source}, ${row.author}`,
        el("details", {}, el("summary", { class: "quiet" }, many(assets.length, "asset")),
          el("code", {}, row.assets)));
    }))));
}

// ---------------------------------------------------------------- sample browser

const LAYERS = [["boxes", "2D boxes"], ["masks", "Masks"], ["keypoints", "Keypoints"],
  ["boxes3d", "3D boxes"], ["points", "LiDAR"], ["depth", "Depth"], ["names", "Names"],
  ["lanes", "Lanes"], ["tracks", "Tracks"]];

const NAMED_PX = 26;

/** A colour of a category that is far from those of the next ones. */
function categoryColor(names, name, alpha = 1) {
  const hue = (names.indexOf(name) * 137.508 + 205) % 360;
  return `hsl(${hue.toFixed(0)} 85% 62% / ${alpha})`;
}

function hasLayer(image, layer) {
  const any = (field) => image.objects.some((item) => item[field]);
  return { boxes: () => any("box"), masks: () => Boolean(image.pictures.masks), keypoints: () => any("keypoints"),
    boxes3d: () => any("edges"), points: () => Boolean(image.points), depth: () => Boolean(image.pictures.depth),
    names: () => any("box"), lanes: () => Boolean(image.lanes), tracks: () => Boolean(image.tracks) }[layer]();
}

const loaded = new Map();

function picture(url) {
  if (!loaded.has(url)) {
    if (loaded.size > 12) loaded.delete(loaded.keys().next().value);
    loaded.set(url, new Promise((resolve) => {
      const image = new Image();
      image.onload = () => resolve(image);
      image.onerror = () => resolve(null);
      image.src = url;
    }));
  }
  return loaded.get(url);
}

/** Objects' masks as a translucent image; object numbers are the grey values of the mask image. */
function tintMasks(source, image, names, shown) {
  const canvas = el("canvas", { width: source.width, height: source.height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(source, 0, 0);
  const data = context.getImageData(0, 0, source.width, source.height);
  const probe = el("canvas", { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const colors = image.objects.map((item, k) => {
    if (!shown.has(k)) return null;
    probe.fillStyle = categoryColor(names, item.category);
    probe.fillRect(0, 0, 1, 1);
    return probe.getImageData(0, 0, 1, 1).data;
  });
  const objects = Uint8Array.from({ length: data.data.length / 4 }, (_, k) => data.data[4 * k]);
  objects.forEach((object, k) => {
    const color = colors[object - 1];
    const outline = color && [k - 1, k + 1, k - source.width, k + source.width].some((n) => objects[n] !== object);
    data.data.set(color ? [color[0], color[1], color[2], outline ? 235 : 105] : [0, 0, 0, 0], 4 * k);
  });
  context.putImageData(data, 0, 0);
  return canvas;
}

function browser() {
  const known = sets.filter((set) => set.browser && set.browser.length);
  if (!known.length) return null;
  const state = { set: known[0], position: 0, picked: null,
    layers: new Set(["boxes", "names"]), filter: { category: "", size: 0, occlusion: 100, distance: Infinity } };
  const canvas = el("canvas", { tabindex: 0, role: "img", "aria-label": "Image with its labels" });
  const message = el("p", { hidden: "" }, "No image has an object that passes the filters.");
  const list = el("div", { class: "card objects" });
  const above = el("figure", { class: "card figure above", hidden: "" });
  const layered = el("figure", { class: "card figure layered", hidden: "" });
  const strip = el("div", { class: "strip" });
  const title = el("span", { class: "quiet", id: "shown" });
  const names = () => (state.set.categories || []).map((row) => row.name);

  const passes = (item) => {
    const { category, size, occlusion, distance } = state.filter;
    if (category && item.category !== category) return false;
    const side = item.box ? Math.sqrt((item.box[2] - item.box[0]) * (item.box[3] - item.box[1])) : 0;
    if (side < size) return false;
    if (100 * (item.occlusion || 0) > occlusion) return false;
    return item.distance_m === undefined || item.distance_m <= distance;
  };
  const filtered = () => state.filter.category || state.filter.size || state.filter.occlusion < 100
    || state.filter.distance < Infinity;
  const visible = () => state.set.browser.filter((image) => !filtered() || image.objects.some(passes));

  let turn = 0;
  async function draw() {
    const mine = ++turn;
    const images = visible();
    state.position = Math.max(0, Math.min(state.position, images.length - 1));
    const image = images[state.position];
    message.hidden = Boolean(image);
    canvas.hidden = !image;
    if (!image) {
      title.textContent = "0 images";
      list.replaceChildren();
      above.hidden = layered.hidden = true;
      return;
    }
    const depth = state.layers.has("depth") && image.pictures.depth;
    const [photo, masks] = await Promise.all([picture(depth || image.pictures.rgb),
      state.layers.has("masks") && image.pictures.masks ? picture(image.pictures.masks) : null]);
    if (mine !== turn || !photo) return;
    const shown = new Set(image.objects.map((item, k) => (passes(item) ? k : -1)).filter((k) => k >= 0));
    paint(image, photo, masks, shown);
    title.textContent = `${state.position + 1} of ${images.length}: sample ${image.index}, ${image.camera}, `
      + `${image.split}, ${image.size_px.join(" × ")} px, ${shown.size} of ${image.objects.length} objects`;
    canvas.dataset.layers = [...state.layers].sort().join(" ");
  }

  function paint(image, photo, masks, shown) {
    const [width, height] = image.size_px;
    const wide = Math.max(200, Math.min(canvas.parentElement.clientWidth, (0.72 * innerHeight * width) / height));
    const scale = Math.min(2, Math.max(1, (wide * devicePixelRatio) / width));
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
    canvas.style.width = `${wide}px`;
    const context = canvas.getContext("2d");
    context.imageSmoothingQuality = "high";
    context.drawImage(photo, 0, 0, canvas.width, canvas.height);
    if (masks) {
      context.imageSmoothingEnabled = false;
      context.drawImage(tintMasks(masks, image, names(), shown), 0, 0, canvas.width, canvas.height);
    }
    context.scale(scale, scale);
    // Lines keep their width on the screen.
    const thin = width / wide;
    if (state.layers.has("points") && image.points) paintPoints(context, image.points, thin);
    if (state.layers.has("lanes")) paintLanes(context, image.lanes || [], thin);
    if (state.layers.has("tracks")) paintTracks(context, image.tracks || [], thin);
    for (const k of shown) paintObject(context, image.objects[k], thin, k === state.picked);
  }

  function paintObject(context, item, thin, picked) {
    const color = categoryColor(names(), item.category);
    context.lineJoin = "round";
    context.strokeStyle = context.fillStyle = color;
    context.lineWidth = (picked ? 3.5 : 1.6) * thin;
    const line = (points) => {
      context.beginPath();
      for (let p = 0; p < points.length; p += 2) context.lineTo(points[p], points[p + 1]);
      context.stroke();
    };
    if (state.layers.has("boxes3d") || picked) (item.edges || []).forEach(line);
    if (item.box && (state.layers.has("boxes") || picked)) {
      const [x0, y0, x1, y1] = item.box;
      context.strokeRect(x0, y0, x1 - x0, y1 - y0);
    }
    if (state.layers.has("keypoints") && item.keypoints) {
      const small = item.box ? Math.min(1, 0.3 + (item.box[3] - item.box[1]) / thin / 150) : 1;
      context.lineWidth = small * 1.6 * thin;
      for (const [a, b] of item.bones) {
        const [one, other] = [item.keypoints[a], item.keypoints[b]];
        if (one[2] && other[2]) line([one[0], one[1], other[0], other[1]]);
      }
      for (const [u, v, seen] of item.keypoints) {
        if (!seen) continue;
        context.beginPath();
        context.arc(u, v, small * 2.6 * thin, 0, 7);
        if (seen === 2) context.fill();
        else context.stroke();
      }
    }
    // Names of small objects would hide others; the list has them.
    const side = item.box ? Math.max(item.box[2] - item.box[0], item.box[3] - item.box[1]) / thin : 0;
    if (item.box && ((state.layers.has("names") && side >= NAMED_PX) || picked)) {
      const size = 11.5 * thin;
      context.font = `600 ${size}px system-ui, sans-serif`;
      const wide = context.measureText(item.category).width + 6 * thin;
      const [x, y] = [item.box[0] - 0.5 * context.lineWidth, Math.max(item.box[1], 1.4 * size)];
      context.fillRect(x, y - 1.35 * size, wide, 1.35 * size);
      context.fillStyle = "#10141b";
      context.fillText(item.category, x + 3 * thin, y - 0.35 * size);
    }
  }

  /** Hidden parts are thin and dark, as hidden points are rings. */
  function paintLanes(context, lanes, thin) {
    for (const [color, visible, line] of lanes) {
      context.strokeStyle = color;
      context.globalAlpha = visible ? 1 : 0.5;
      context.lineWidth = (visible ? 2.4 : 1.2) * thin;
      context.beginPath();
      for (let p = 0; p < line.length; p += 2) context.lineTo(line[p], line[p + 1]);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  function paintTracks(context, tracks, thin) {
    for (const [color, visible, u, v] of tracks) {
      context.strokeStyle = context.fillStyle = color;
      context.lineWidth = 1.4 * thin;
      context.beginPath();
      context.arc(u, v, 3 * thin, 0, 7);
      if (visible) context.fill();
      else context.stroke();
    }
  }

  function paintPoints(context, packed, thin) {
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    const values = new Uint16Array(bytes.buffer);
    const side = 2 * thin;
    for (let p = 0; p < values.length; p += 3) {
      context.fillStyle = `#${values[p + 2].toString(16).padStart(3, "0")}`;
      context.fillRect(values[p] - side / 2, values[p + 1] - side / 2, side, side);
    }
  }

  function listObjects() {
    const image = visible()[state.position];
    if (!image) return;
    const shown = image.objects.map((item, k) => ({ item, k })).filter(({ item }) => passes(item));
    const cell = (value, text) => (value === undefined ? "-" : text(value));
    list.replaceChildren(table(["object", "visible", "occl.", "trunc.", "m", "points"],
      shown.map(({ item }) => [`${item.category} ${item.instance}`, cell(item.visible_fraction, percent),
        cell(item.occlusion, percent), cell(item.truncation, percent), cell(item.distance_m, (v) => number(v, 2)),
        cell(item.lidar_points, number)]),
      { picked: (row) => { state.picked = shown[row].k; draw(); } }));
  }

  function showFigures() {
    const { occupancy, layers, pictures } = visible()[state.position] || { pictures: {} };
    layered.hidden = !pictures.layers;
    if (pictures.layers) {
      layered.replaceChildren(el("img", { src: pictures.layers, alt: "Layers and mirrors" }),
        el("figcaption", { class: "quiet" }, `From top to bottom: ${layers.join(", ")}, from the first surface on.`));
    }
    above.hidden = !pictures.occupancy;
    if (above.hidden) return;
    const { shape, sensors } = occupancy;
    const seen = occupancy.observed_surface / Math.max(1, occupancy.surface);
    const text = `Occupancy from above, X upwards: ${shape.join(" × ")} voxels of ${occupancy.voxel_m} m. `
      + `${number(occupancy.surface)} with a surface, ${number(occupancy.interior)} within objects and the ground, `
      + `${number(occupancy.free)} free.`
      + (sensors.length ? ` ${percent(seen)} of the surfaces observed by ${sensors.join(", ")}; others are dark.` : "");
    above.replaceChildren(el("img", { src: pictures.occupancy, alt: "Occupancy from above", width: shape[1],
      height: shape[0] }), el("figcaption", { class: "quiet" }, text));
  }

  function listStrip() {
    const images = visible();
    strip.replaceChildren(...images.map((image, k) => el("button", {
      "aria-label": `sample ${image.index}, ${image.camera}`, click: () => go(k) },
    el("img", { src: image.pictures.rgb, alt: "", loading: "lazy" }))));
    go(state.position);
  }

  function go(position) {
    const count = visible().length;
    state.position = count ? (position + count) % count : 0;
    state.picked = null;
    [...strip.children].forEach((button, k) => button.setAttribute("aria-current", String(k === state.position)));
    const current = strip.children[state.position];
    if (current) {
      strip.scrollLeft = current.offsetLeft - strip.offsetLeft - strip.clientWidth / 2 + current.clientWidth / 2;
    }
    listObjects();
    showFigures();
    draw();
  }

  function refresh() {
    state.position = 0;
    listStrip();
  }

  const toggles = LAYERS.map(([layer, text], k) => el("button", { "data-layer": layer,
    "aria-pressed": String(state.layers.has(layer)), click: () => toggle(layer) }, text, el("kbd", {}, String(k + 1))));
  function toggle(layer) {
    const button = toggles.find((item) => item.dataset.layer === layer);
    if (button.disabled) return;
    if (state.layers.has(layer)) state.layers.delete(layer);
    else state.layers.add(layer);
    button.setAttribute("aria-pressed", String(state.layers.has(layer)));
    draw();
  }
  const available = () => toggles.forEach((button) => {
    button.disabled = !state.set.browser.some((image) => hasLayer(image, button.dataset.layer));
  });

  const limit = (label, key, value, none) => el("label", {}, label, el("input", { type: "number", min: 0,
    placeholder: "any", "data-filter": key, input: (event) => {
      state.filter[key] = event.target.value === "" ? none : Number(event.target.value);
      refresh();
    } }));
  const categories = el("span");
  function choose(set) {
    state.set = set;
    state.filter.category = "";
    const used = names().filter((name) => set.browser.some((image) =>
      image.objects.some((item) => item.category === name)));
    const choices = [["", "all"], ...used.map((name) => [name, name])];
    categories.replaceChildren(el("label", {}, "Category", options(choices, "Category of the objects", (value) => {
      state.filter.category = value;
      refresh();
    })));
    available();
    refresh();
  }

  document.addEventListener("keydown", (event) => {
    if (event.target.matches("input, select") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
      event.preventDefault();
      go(state.position + (event.key === "ArrowRight" ? 1 : -1));
    }
    const layer = LAYERS[Number(event.key) - 1];
    if (layer) toggle(layer[0]);
  });
  addEventListener("resize", () => draw());
  const which = known.length > 1 ? options(known.map((set, k) => [String(k), set.name]), "Data set of the images",
    (value) => choose(known[Number(value)])) : null;
  const whole = el("div", {},
    el("div", { class: "bar" }, which, ...toggles),
    el("div", { class: "bar filters" }, categories, limit("Size at least, px", "size", 0, 0),
      limit("Occlusion at most, %", "occlusion", 100, 100), limit("Distance at most, m", "distance", 0, Infinity)),
    el("div", { class: "bar" },
      el("button", { "aria-label": "Previous image", click: () => go(state.position - 1) }, "←"),
      el("button", { "aria-label": "Next image", click: () => go(state.position + 1) }, "→"), title),
    el("div", { class: "viewer" }, el("div", {}, el("div", { class: "stage" }, canvas, message), strip),
      el("div", {}, list, above, layered)));
  // The canvas has no width before it is in the page.
  requestAnimationFrame(() => choose(known[0]));
  return whole;
}

// ---------------------------------------------------------------- page

function theme() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const set = (name) => document.documentElement.setAttribute("data-theme", name);
  set(dark.matches ? "dark" : "light");
  dark.addEventListener("change", () => set(dark.matches ? "dark" : "light"));
  return el("button", { "aria-label": "Dark or light", click: () =>
    set(document.documentElement.getAttribute("data-theme") === "dark" ? "light" : "dark") }, "◐");
}

const parts = [
  ["samples", "Samples", "Images spread evenly over the data set. Arrow keys go through them, number keys toggle layers; an object of the list is outlined.", browser],
  ["balance", "Categories", "", balance],
  ["objects", "Objects", "The last bar includes all larger values.", objectCharts],
  ["viewpoints", "Viewpoints", "Directions from which cameras see objects, in the frame of the object: azimuth 0 is its front (+X), 90 its left. All cells have the same area on the sphere.", viewpoints],
  ["pictures", "Images", "", imageCharts],
  ["parameters", "Parameters", "Bars: drawn values. Line: the declared distribution.", parameters],
  ["checks", "Checks", "", checks],
  ["duplicates", "Near-duplicates", "Images of different scenes whose perceptual hashes differ in at most 4 of 64 bits.", duplicates],
  ["cost", "Cost", "", costs],
  ["tables", "Tables", "", tables],
  ["licences", "Licences", "", licences],
];

function build() {
  const built = parts.map(([id, title, note, make]) => section(id, title, note, make())).filter((item) => item);
  const links = built.map((item) => el("a", { href: `#${item.id}` }, item.querySelector("h2").textContent));
  document.body.append(
    el("header", { class: "top" }, el("strong", {}, sets.map((set) => set.name).join(" | ")), el("nav", {}, ...links), theme()),
    el("main", {}, ...sets.map(overview), legend(), ...built));
}

build();
