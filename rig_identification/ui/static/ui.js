// The forms of the page: what is typed goes to the server as JSON, and a fault comes back to its field.
(() => {
  const own = (element, selector) => [...element.querySelectorAll(selector)];
  const place = field => field.parentElement.closest("[data-section], [data-entry], [data-cable], form");
  const asNumber = input => input.value.trim() === "" ? null : Number(input.value);

  // What a field holds; undefined where nothing is typed.
  const held = field => {
    const inputs = own(field, "input, select");
    switch (field.dataset.kind) {
      case "number": return asNumber(inputs[0]) ?? undefined;
      case "vector": {
        const numbers = inputs.map(asNumber);
        return numbers.every(n => n === null) ? undefined : numbers;
      }
      case "flag": return inputs[0].checked;
      default: return inputs[0].value || undefined;
    }
  };
  const gathered = (box, kept = {}) => {
    const found = {...kept};
    own(box, ".field").filter(f => place(f) === box && f.dataset.kind !== "name").forEach(f => {
      const value = held(f);
      if (value !== undefined) found[f.dataset.key] = value;
    });
    const inside = selector => own(box, selector).filter(s => place(s) === box);
    inside("[data-section]").forEach(s => {
      const values = gathered(s);
      if (!s.classList.contains("off") && (Object.keys(values).length || s.dataset.optional !== undefined)) found[s.dataset.section] = values;
    });
    inside("[data-entry]").forEach(s => (found[s.dataset.entry] ??= []).push(gathered(s)));
    inside("[data-cable]").forEach(s => {
      const name = s.querySelector("[data-kind=name] input").value.trim();
      (found.cables ??= []).push(name);
      found[name] = gathered(s);
    });
    return found;
  };
  // Key of a field from the top of the form, as a fault names it.
  const keyOf = field => {
    const parts = [field.dataset.key];
    for (let box = place(field); box && box.tagName !== "FORM"; box = place(box)) {
      if (box.dataset.section) parts.unshift(box.dataset.section);
      else if (box.dataset.cable !== undefined) parts.unshift(box.querySelector("[data-kind=name] input").value.trim());
      else parts.unshift(`${box.dataset.entry}[${own(box.closest("form"), `[data-entry="${box.dataset.entry}"]`).indexOf(box)}]`);
    }
    return parts.join(".");
  };
  const clear = form => {
    own(form, ".wrong").forEach(f => f.classList.remove("wrong"));
    own(form, ".fault").forEach(f => { f.hidden = true; f.textContent = ""; });
  };
  // A fault of a whole section, or of one number of a field, is told at the nearest thing of that name.
  const tell = (form, {key, problem}) => {
    clear(form);
    const bare = key.replace(/\[\d+\]$/, ""), fields = own(form, ".field").filter(f => !f.hidden);
    const at = fields.find(f => keyOf(f) === key) ?? fields.find(f => keyOf(f) === bare) ?? fields.find(f => keyOf(f).startsWith(key + ".") && key);
    const line = at ? at.querySelector(".fault") : form.querySelector(".fault.whole");
    at?.classList.add("wrong");
    for (let d = at?.closest("details"); d; d = d.parentElement.closest("details")) d.open = true;
    line.textContent = at || !key ? problem : `${key}: ${problem}`;
    line.hidden = false;
    return line;
  };
  const ask = async (url, values, signal) => {
    const answer = await fetch(url, {method: "POST", headers: {"content-type": "application/json"}, body: JSON.stringify(values), signal});
    return answer.headers.get("content-type")?.startsWith("application/json") ? answer.json() : {fault: {key: "", problem: await answer.text()}};
  };
  const fill = html => Object.entries(html ?? {}).forEach(([id, text]) => { document.getElementById(id).innerHTML = text; });
  const all = form => gathered(form, JSON.parse(form.dataset.kept ?? "{}"));

  own(document, "form[data-post]").forEach(form => {
    form.addEventListener("submit", async event => {
      event.preventDefault();
      const button = event.submitter ?? form.querySelector("[type=submit]");
      button.disabled = true;
      try {
        const answer = await ask(button.dataset.post ?? form.dataset.post, all(form));
        if (answer.fault) tell(form, answer.fault).scrollIntoView({block: "center"});
        else clear(form);
        fill(answer.html);
        if (answer.go) location.assign(answer.go);
      } catch { tell(form, {key: "", problem: "The page's server does not answer; is rig-identification ui still running?"}); }
      finally { button.disabled = false; }
    });
    if (!form.dataset.live) return;
    let waiting = 0, asked = null;
    const live = () => {
      clearTimeout(waiting);
      waiting = setTimeout(async () => {
        asked?.abort();
        asked = new AbortController();
        try {
          const answer = await ask(form.dataset.live, all(form), asked.signal);
          fill(answer.html);
          if (answer.fault) tell(form, answer.fault); else clear(form);
        } catch {}
      }, 250);
    };
    ["input", "change", "changed"].forEach(kind => form.addEventListener(kind, live));
    live();
  });

  // Fields that belong to one choice of another field.
  const fit = () => own(document, "[data-when]").forEach(part => {
    const [key, value] = part.dataset.when.split("=");
    part.hidden = part.closest("form").querySelector(`.field[data-key="${key}"] select`).value !== value;
  });
  document.addEventListener("change", fit);
  fit();

  // Parts of a description that may be left out, and cables that come and go.
  document.addEventListener("change", event => {
    if (event.target.matches(".switch input")) event.target.closest("fieldset").classList.toggle("off", !event.target.checked);
  });
  document.addEventListener("click", event => {
    const button = event.target.closest("button.add, button.remove");
    if (!button) return;
    const form = button.closest("form");
    if (button.matches(".remove")) button.closest("[data-cable]").remove();
    else {
      const copy = document.getElementById("new-cable").content.cloneNode(true), names = own(form, "[data-kind=name] input").map(i => i.value);
      let count = names.length + 1;
      while (names.includes(`cable_${count}`)) count++;
      copy.querySelector("[data-kind=name] input").value = `cable_${count}`;
      button.before(copy);
    }
    form.dispatchEvent(new Event("changed"));
  });

  // A task under way.
  const job = document.querySelector("#job");
  if (job) {
    const bar = job.querySelector("progress"), url = `/jobs/${job.dataset.id}`;
    const show = told => {
      if (told.state !== "running") { location.reload(); return false; }
      job.querySelector(".stage").textContent = told.stage;
      job.querySelector(".seconds").textContent = `${told.seconds.toFixed(0)} s`;
      if (told.fraction === null) bar.removeAttribute("value"); else bar.value = told.fraction;
      job.querySelector(".stopping").hidden = !told.stopping;
      job.querySelector(".stages").replaceChildren(...told.stages.map(text => Object.assign(document.createElement("li"), {textContent: text})));
      return true;
    };
    const look = async () => {
      try { if (!show(await (await fetch(`${url}/state`)).json())) return; }
      catch { job.querySelector(".stage").textContent = "The page's server does not answer."; }
      setTimeout(look, 400);
    };
    job.querySelector(".stop").addEventListener("click", async () => { await fetch(`${url}/stop`, {method: "POST"}); });
    look();
  }
})();
