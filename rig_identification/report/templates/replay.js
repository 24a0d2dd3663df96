// Plays a run back in a drawing of the rig.
(() => {
  const box = document.querySelector("#replay");
  if (!box) return;
  const rig = JSON.parse(document.querySelector("#poses").textContent);
  const svg = box.querySelector("svg"), slider = box.querySelector("input"), button = box.querySelector("button");
  const [run, speed] = box.querySelectorAll("select"), told = box.querySelector("output");
  const make = (name, style) => { const e = document.createElementNS("http://www.w3.org/2000/svg", name); e.setAttribute("class", style); svg.append(e); return e; };
  const flat = p => [0, 1].map(k => rig.axes[k][0] * p[0] + rig.axes[k][1] * p[1] + rig.axes[k][2] * p[2] - rig.middle[k])
    .map((v, k) => k ? rig.height / 2 - rig.scale * v : rig.width / 2 + rig.scale * v);
  const turned = ([x, y, z, w], p) => {
    const t = [2 * (y * p[2] - z * p[1]), 2 * (z * p[0] - x * p[2]), 2 * (x * p[1] - y * p[0])];
    return [p[0] + w * t[0] + y * t[2] - z * t[1], p[1] + w * t[1] + z * t[0] - x * t[2], p[2] + w * t[2] + x * t[1] - y * t[0]];
  };
  // Convex outline of points in the plane (Andrew's monotone chain).
  const outline = points => {
    const half = ps => ps.reduce((h, p) => {
      while (h.length > 1 && (h.at(-1)[0] - h.at(-2)[0]) * (p[1] - h.at(-2)[1]) <= (h.at(-1)[1] - h.at(-2)[1]) * (p[0] - h.at(-2)[0])) h.pop();
      return [...h, p];
    }, []);
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    return [...half(sorted).slice(0, -1), ...half(sorted.reverse()).slice(0, -1)];
  };
  const body = make("path", "body"), cables = rig.cables.map(() => make("path", "cable"));
  const marks = rig.names.map(name => make("circle", name === "" ? "device" : "hinge"));
  rig.ceiling.forEach(p => { const [x, y] = flat(p); make("path", "ceiling").setAttribute("d", `M${x - 9} ${y}h18`); });
  let poses = null, at = 0, last = 0, playing = false;
  const find = time => { // the frame at or before a time
    let low = 0, high = poses.length / 8 - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; poses[8 * middle] <= time ? low = middle : high = middle - 1; }
    return low;
  };
  const show = time => {
    at = time;
    const f = 8 * find(time), place = poses.subarray(f + 1, f + 4), turn = poses.subarray(f + 4, f + 8);
    const points = rig.body.map(p => flat(turned(turn, p).map((v, i) => v + place[i])));
    body.setAttribute("d", "M" + outline(points).map(p => p.map(v => v.toFixed(1)).join(" ")).join("L") + "Z");
    cables.forEach((c, i) => c.setAttribute("d", "M" + [flat(rig.ceiling[i]), points[i]].map(p => p.map(v => v.toFixed(1)).join(" ")).join("L")));
    marks.forEach((m, i) => { m.setAttribute("cx", points[i][0].toFixed(1)); m.setAttribute("cy", points[i][1].toFixed(1)); m.setAttribute("r", rig.names[i] === "" ? 6 : 3); });
    slider.value = time;
    told.textContent = time.toFixed(2) + " s";
  };
  const choose = () => {
    poses = new Float32Array(Uint8Array.from(atob(rig.runs[run.value]), c => c.charCodeAt(0)).buffer);
    slider.min = poses[0];
    slider.max = poses[poses.length - 8];
    show(poses[0]);
  };
  const step = now => {
    if (!playing) return;
    const time = at + Number(speed.value) * (now - last) / 1000;
    last = now;
    show(time > Number(slider.max) ? Number(slider.min) : time);
    requestAnimationFrame(step);
  };
  button.addEventListener("click", () => {
    playing = !playing;
    button.textContent = playing ? "Stop" : "Play";
    last = performance.now();
    if (playing) requestAnimationFrame(step);
  });
  slider.addEventListener("input", () => show(Number(slider.value)));
  run.addEventListener("change", choose);
  choose();
})();
