// The live page: events of the graph, drawn as they come. Nothing is computed here but pixels.
(() => {
  const live = document.querySelector("#live"), namespace = live.dataset.namespace;
  const find = selector => live.querySelector(selector);
  const text = (element, words) => { if (element.textContent !== words) element.textContent = words; };
  const make = (tag, words = "", classes = "") => Object.assign(document.createElement(tag), {textContent: words, className: classes});
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const state = (words, bad = false) => { const p = find(".state"); text(p, words); p.classList.toggle("bad", bad); };

  // Numbers with an interval: two digits of the half-width, as many decimals of the value.
  const HALF = 1.96;
  const told = (value, std) => {
    if (value === null || std === null || !Number.isFinite(std)) return "–";
    const half = HALF * std, decimals = Math.max(0, 1 - Math.floor(Math.log10(Math.max(half, 1e-9))));
    return decimals > 8 ? "–" : `${value.toFixed(decimals)} ± ${half.toFixed(decimals)}`;
  };

  // The rig
  const canvas = find(".scene canvas"), pen = canvas.getContext("2d");
  let shapes = [], yaw = 0.6, pitch = 0.25, frames = [], trail = [], box = null, tension = {};
  const project = ([x, y, z]) => {
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)], across = c * x + s * y, deep = -s * x + c * y;
    return [across, z * Math.cos(pitch) + deep * Math.sin(pitch)];
  };
  const draw = () => {
    const wide = canvas.clientWidth, high = canvas.clientHeight, dots = window.devicePixelRatio || 1;
    if (!wide) return;
    if (canvas.width !== Math.round(wide * dots)) { canvas.width = Math.round(wide * dots); canvas.height = Math.round(high * dots); }
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    pen.clearRect(0, 0, wide, high);
    const points = shapes.flatMap(s => s.points).filter(p => !p.includes(null));
    if (!points.length) return;
    box ??= points.reduce((b, p) => b.map(([low, up], k) => [Math.min(low, p[k]), Math.max(up, p[k])]), [[1e9, -1e9], [1e9, -1e9], [1e9, -1e9]]);
    const middle = box.map(([low, up]) => (low + up) / 2), size = Math.hypot(...box.map(([low, up]) => up - low)) || 1;
    const scale = 0.92 * Math.min(wide, 1.35 * high) / size, [u0, v0] = project(middle);
    const place = p => { const [u, v] = project(p); return [wide / 2 + scale * (u - u0), high / 2 - scale * (v - v0)]; };
    pen.lineCap = "round";
    pen.strokeStyle = colour("accent"); pen.globalAlpha = 0.35; pen.lineWidth = 1.5;
    pen.beginPath(); trail.forEach((p, k) => pen[k ? "lineTo" : "moveTo"](...place(p))); pen.stroke(); pen.globalAlpha = 1;
    for (const shape of shapes) {
      const at = shape.points.map(p => p.includes(null) ? null : place(p));
      const shade = k => shape.colours[k] ? `rgb(${shape.colours[k].join(" ")})` : {body: colour("ink"), devices: "#e08a1a"}[shape.name] ?? colour("muted");
      if (shape.lines) for (let k = 0; k + 1 < at.length; k += 2) {
        if (!at[k] || !at[k + 1]) continue;
        pen.strokeStyle = shade(k); pen.lineWidth = shape.name === "body" ? 2.5 : 2;
        pen.beginPath(); pen.moveTo(...at[k]); pen.lineTo(...at[k + 1]); pen.stroke();
      } else at.forEach((p, k) => { if (p) { pen.fillStyle = shade(k); pen.beginPath(); pen.arc(...p, shape.name === "devices" ? 4 : 3, 0, 7); pen.fill(); } });
    }
  };
  let held = null;
  canvas.addEventListener("pointerdown", e => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", e => {
    if (!held) return;
    yaw += (e.clientX - held[0]) / 150; pitch = Math.max(-1.5, Math.min(1.5, pitch + (e.clientY - held[1]) / 150));
    held = [e.clientX, e.clientY]; draw();
  });
  ["pointerup", "pointercancel"].forEach(kind => canvas.addEventListener(kind, () => { held = null; }));
  const rig = said => {
    shapes = said.shapes;
    const body = shapes.find(s => s.name === "body")?.points.filter(p => !p.includes(null)) ?? [];
    if (body.length) { trail.push([0, 1, 2].map(k => body.reduce((sum, p) => sum + p[k], 0) / body.length)); if (trail.length > 80) trail.shift(); }
    const now = performance.now();
    frames.push(now); while (now - frames[0] > 3000) frames.shift();
    if (frames.length > 3) text(find(".scene .rate"), `${(1000 * (frames.length - 1) / (now - frames[0])).toFixed(0)} pictures a second.`);
    draw();
  };

  // Tensions: a bar each, of the largest seen
  const bars = find("#tensions .bars"), rows = {};
  let largest = 1;
  const pull = said => {
    tension = said.tension;
    const names = Object.keys(tension).sort();
    if (names.length && bars.querySelector("p")) bars.replaceChildren();
    names.forEach(name => {
      if (!rows[name]) {
        const row = make("div", "", "bar"), track = make("div", "", "track"), fill = make("div");
        track.append(fill); row.append(make("span", name), track, make("output"));
        rows[name] = {row, fill, value: row.lastChild};
        bars.append(row);
      }
      if (tension[name] !== null) largest = Math.max(largest, Math.abs(tension[name]));
    });
    Object.entries(rows).forEach(([name, {row, fill, value}]) => {
      const now = tension[name] ?? null;
      row.classList.toggle("silent", now === null);
      fill.style.width = now === null ? "0" : `${Math.max(0, 100 * now / largest)}%`;
      text(value, now === null ? "silent" : `${now.toFixed(now < 100 ? 2 : 1)} N`);
    });
  };

  // Charts
  const axis = () => ({stroke: colour("muted"), grid: {stroke: colour("line"), width: 1}, ticks: {stroke: colour("line"), width: 1}});
  const fitted = place => new ResizeObserver(() => plots.get(place)?.setSize({width: place.clientWidth, height: plots.get(place).height})).observe(place);
  const plots = new Map();
  const chart = (place, options, data) => {
    if (plots.has(place)) { plots.get(place).setData(data); return; }
    plots.set(place, new uPlot({width: place.clientWidth, ...options}, data, place));
    fitted(place);
  };

  // The running estimate
  const NAMES = ["m", "cx", "cy", "cz", "Jxx", "Jxy", "Jxz", "Jyy", "Jyz", "Jzz"], UNITS = ["kg", "m", "m", "m", ...Array(6).fill("kg m²")];
  const SHOWN = [[4, "accent"], [7, "fair"], [9, "good"]];
  const table = find("#inertia table"), course = [], fitOf = [];
  let latest = null;
  const fillTable = () => {
    table.hidden = !(latest || fitOf.length);
    NAMES.forEach((name, k) => {
      const row = table.rows[k + 1] ?? table.insertRow();
      if (!row.cells.length) { row.append(make("td", `${name}, ${UNITS[k]}`), make("td", "", "n"), make("td", "", "n")); }
      text(row.cells[1], latest ? told(latest.values[k], latest.std[k]) : "–");
      text(row.cells[2], fitOf.length ? told(...fitOf[k]) : "–");
    });
  };
  const running = said => {
    find("#inertia .none").hidden = true;
    if (course.length && said.time < course[course.length - 1].time) course.length = 0;
    course.push(said); latest = said;
    fillTable();
    const begin = course[0].time, ranges = course.filter(c => SHOWN.every(([k]) => c.std[k] !== null && HALF * c.std[k] < Math.abs(c.values[k])));
    const kept = ranges.length > 1 ? ranges : course;
    const data = [kept.map(c => c.time - begin)], series = [{label: "s", value: (_, v) => v == null ? "–" : v.toFixed(0)}], bands = [];
    SHOWN.forEach(([k, name]) => {
      const at = data.length;
      data.push(kept.map(c => c.values[k]), kept.map(c => c.values[k] + HALF * c.std[k]), kept.map(c => c.values[k] - HALF * c.std[k]));
      series.push({label: NAMES[k], stroke: colour(name), width: 2, points: {show: false}, value: (_, v) => v == null ? "–" : v.toPrecision(5)},
        ...["upper", "lower"].map(side => ({label: `${NAMES[k]} ${side}`, stroke: colour(name), width: .5, points: {show: false}})));
      bands.push({series: [at + 1, at + 2], fill: `color-mix(in srgb, ${colour(name)} 18%, transparent)`});
    });
    if (kept.length > 1) chart(find("#inertia .plot"), {height: 220, scales: {x: {time: false}}, legend: {show: false}, axes: [{...axis(), size: 40, label: "s of motion", labelSize: 16}, {...axis(), size: 64, label: "kg m²", labelSize: 18}], series, bands}, data);
  };

  // What a look said
  const CHIPS = {none: ["good", "sound so far"], explained: ["bad", "found"], unexplained: ["bad", "not explained"]};
  const body = part => {
    const out = [];
    const value = (held, k) => held && held.value !== undefined ? [k === undefined ? held.value : held.value?.[k] ?? null, k === undefined ? held.std : held.std?.[k] ?? null] : [null, null];
    out.push(value(part.mass), ...[0, 1, 2].map(k => value(part.center_of_mass, k)));
    const J = part.inertia;
    [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]].forEach(([i, j]) => out.push([J?.value?.[i]?.[j] ?? null, J?.std?.[i]?.[j] ?? null]));
    return out;
  };
  const watch = ({watch: said}) => {
    const card = find("#verdict"), chip = card.querySelector(".chip"), kind = CHIPS[said.verdict];
    chip.hidden = !kind && !said.faults?.length;
    chip.className = `chip ${said.faults?.length ? "bad" : kind?.[0] ?? ""}`;
    text(chip, said.faults?.length ? "set-up" : kind?.[1] ?? "");
    text(card.querySelector(".of"), said.recording ? `${said.recording}, after ${said.seconds.toFixed(0)} s of it; the look took ${said.took.toFixed(0)} s` : "");
    text(card.querySelector(".text"), said.text);
    card.querySelector(".faults").replaceChildren(...(said.faults ?? []).filter(f => f !== said.text).map(f => make("li", f)));
    fitOf.length = 0;
    if (said.body) fitOf.push(...body(said.body));
    fillTable();
    const f = said.forecast;
    if (!f) return;
    const end = f.seconds[f.seconds.length - 1], percent = x => `${(100 * x).toPrecision(2)} %`;
    const force = f.force === "planned" ? " The exciter is taken to follow its plan." : "";
    text(find("#forecast .text"), (f.enough === null
      ? `Each element of J will be known to ${percent(f.share[f.share.length - 1])} after ${end.toFixed(0)} s, not to the ${percent(f.aim)} that is aimed for.`
      : f.enough <= f.seconds[0] ? `Enough: each element of J is known to ${percent(f.aim)}. After ${end.toFixed(0)} s it would be ${percent(f.share[f.share.length - 1])}.`
      : `Enough at ${f.enough.toFixed(0)} s: from then on each element of J is known to ${percent(f.aim)}. After ${end.toFixed(0)} s it will be ${percent(f.share[f.share.length - 1])}.`) + force);
    chart(find("#forecast .plot"), {height: 170, legend: {show: false}, scales: {x: {time: false}, y: {distr: 3}},
      axes: [{...axis(), size: 40, label: "length of the run, s", labelSize: 16}, {...axis(), size: 64, label: "J, 95 %, in %", labelSize: 18}],
      series: [{}, {stroke: colour("accent"), width: 2, points: {show: true, size: 4}}, {stroke: colour("good"), width: 1, dash: [5, 4], points: {show: false}}]},
      [f.seconds, f.share.map(s => 100 * s), f.seconds.map(() => 100 * f.aim)]);
  };

  // What nodes say of themselves
  const list = find(".diagnostics"), lines = {};
  const LEVELS = ["", "warning", "error", "silent"];
  const diagnostic = ({name, level, message}) => {
    lines[name] = {level, message};
    const bad = Object.entries(lines).filter(([, line]) => line.level > 0);
    list.replaceChildren(...(bad.length ? bad.map(([from, line]) => {
      const item = make("li");
      item.append(make("b", `${LEVELS[line.level] ?? "error"} `, line.level > 1 ? "bad" : "fair"), `${from}: ${line.message}`);
      return item;
    }) : [make("li", "Every node says that it is well.")]));
  };

  // The window
  const form = find("#window");
  let open = false;
  const windowSaid = ({window: words}) => { open = / is open/.test(words); text(form.querySelector(".open"), words); };
  form.addEventListener("submit", async event => {
    event.preventDefault();
    const button = event.submitter ?? form.querySelector("[data-do=start]"), fault = form.querySelector(".fault.whole"), values = {do: button.dataset.do, namespace};
    if (values.do === "start") {
      values.window = form.querySelector("[data-key=window] select").value;
      values.name = form.querySelector("[data-key=name] input").value.trim();
      values.holdout = form.querySelector("[data-key=holdout] input").checked;
      const mass = form.querySelector("[data-key=dummy_mass] input").value, at = [...form.querySelectorAll("[data-key=dummy_position] input")].map(i => Number(i.value));
      if (mass !== "") { values.dummy_mass = Number(mass); values.dummy_position = at; }
    }
    fault.hidden = true; button.disabled = true;
    text(form.querySelector(".told"), values.do === "stop" ? "Waiting for the last messages." : "");
    try {
      const answer = await (await fetch("/live/window", {method: "POST", headers: {"content-type": "application/json"}, body: JSON.stringify(values)})).json();
      text(form.querySelector(".told"), answer.told ?? "");
      if (answer.fault) { fault.textContent = answer.fault.key ? `${answer.fault.key}: ${answer.fault.problem}` : answer.fault.problem; fault.hidden = false; }
    } catch { fault.textContent = "The page's server does not answer."; fault.hidden = false; }
    finally { button.disabled = false; }
  });

  const graph = said => {
    state(said.identifier ? `Connected below ${said.namespace}: ${said.cells.length} load cells and the identifier.`
      : said.cells.length ? `Connected below ${said.namespace}: ${said.cells.length} load cells; no identifier answers.`
      : `Nothing is heard below ${said.namespace} yet. Start the graph, or check the namespace and ROS_DOMAIN_ID.`);
  };
  const heard = {graph, rig, tension: pull, running, watch, diagnostic, window: windowSaid,
    ended: said => state(`The program that listens to the graph has ended: ${said.message}.`, true),
    missing: said => { state(`ROS 2 is not there, and the live page needs it: pip install 'rig_identification[ros]' (${said.message}).`, true); events.close(); }};
  const events = new EventSource(`/live/events?namespace=${encodeURIComponent(namespace)}`);
  events.addEventListener("message", event => { const said = JSON.parse(event.data); heard[said.kind]?.(said); });
  events.addEventListener("error", () => { if (events.readyState === EventSource.CLOSED) state("The page's server refused to listen: correct the namespace, as /rig.", true); });
  new ResizeObserver(draw).observe(canvas);
})();
