"use strict";
(() => {
  const by = (id) => document.getElementById(id);
  const state = { about: null, picture: null, reply: null, shown: 0, turn: 0, asked: 0, urls: [] };
  // Scores of unrelated pictures: half of them at most 1, none above 7 (documentation of partial matching).
  const [USUAL, GREATEST] = [1, 7];

  // ---- talking to the service ----
  const credentials = () => {
    const token = sessionStorage.getItem("pliant-token");
    return token ? { Authorization: `Bearer ${token}` } : {};
  };
  const ask = async (path, body, signal) => {
    let answer;
    try {
      answer = await fetch(path, { method: body ? "POST" : "GET", body, signal, headers: credentials() });
    } catch {
      throw new Error("The service does not answer. Is it still running?");
    }
    if (answer.ok) return answer;
    const { error } = await answer.json().catch(() => ({ error: `the service answered ${answer.status}` }));
    throw Object.assign(new Error(sentence(error)), { status: answer.status });
  };
  const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".");
  const number = (value) => value.toLocaleString("en");
  const plural = (count, one) => `${number(count)} ${one}${count === 1 ? "" : one === "class" ? "es" : "s"}`;
  const form = (fields) => {
    const data = new FormData();
    Object.entries(fields).forEach(([key, value]) => { if (value !== "") data.append(key, value); });
    return data;
  };
  const complain = (text) => {
    by("problem").textContent = text;
    by("problem").hidden = !text;
  };

  // ---- pictures of the index ----
  const preview = async (id) => URL.createObjectURL(await (await ask(`/api/items/${id}/preview`)).blob());
  const loaded = (url) => new Promise((resolve, reject) => {
    const image = new Image();
    image.onload = () => resolve(image);
    image.onerror = () => reject(new Error("The picture cannot be shown."));
    image.src = url;
  });

  const element = (name, className, text) => {
    const made = document.createElement(name);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const spoken = (label) => label.replaceAll("_", " ");
  const title = (item) => spoken(item.label) || item.name.split("/").pop() || `Picture ${item.id}`;

  const card = (item, rank, bits) => {
    const button = element("button", "match appear");
    button.type = "button";
    button.dataset.id = item.id;
    button.style.animationDelay = `${Math.min(rank, 16) * 25}ms`;
    const frame = element("span", "frame");
    const image = element("img");
    image.alt = "";
    frame.append(image);
    const words = element("span", "words");
    words.append(element("b", "", title(item)));
    if (bits) {
      words.append(element("small", "", `${item.distance} of ${bits} bits apart`));
      const meter = element("span", "meter");
      const full = element("i");
      full.style.width = `${100 * Math.max(0, 1 - 2 * item.distance / bits)}%`;
      meter.append(full);
      words.append(meter);
      button.setAttribute("aria-label", `Match ${rank + 1}: ${title(item)}, ${item.distance} of ${bits} bits apart. Show shared features`);
      button.addEventListener("click", () => open(rank));
    } else {
      words.append(element("small", "", item.name));
      button.setAttribute("aria-label", `Search with ${item.name}`);
      button.addEventListener("click", () => searchWithItem(item));
    }
    button.append(frame, words);
    const entry = element("li");
    entry.append(button);
    return { entry, image };
  };

  const fill = async (items, bits) => {
    state.urls.forEach((url) => URL.revokeObjectURL(url));
    state.urls = [];
    const turn = ++state.turn;
    const cards = items.map((item, rank) => card(item, rank, bits));
    by("results").replaceChildren(...cards.map(({ entry }) => entry));
    await Promise.all(items.map(async (item, k) => {
      try {
        const url = await preview(item.id);
        if (turn !== state.turn) { URL.revokeObjectURL(url); return; }
        state.urls.push(url);
        cards[k].image.src = url;
      } catch { cards[k].image.remove(); }
    }));
    if (turn === state.turn) by("results").dataset.shown = items.length;
  };

  // ---- searching ----
  const search = async () => {
    if (!state.picture) return;
    const picture = state.picture;
    complain("");
    if (picture.size > state.about.upload_bytes) {
      complain(`The picture has ${(picture.size / 1e6).toFixed(1)} MB; the service takes up to ${state.about.upload_bytes / 1e6}.`);
      return;
    }
    by("results").classList.add("waiting");
    by("results").setAttribute("aria-busy", "true");
    by("told").textContent = "Searching …";
    const asked = ++state.asked;
    try {
      const fields = { image: picture, count: by("count").value, label: by("label").value };
      const reply = await (await ask("/api/query", form(fields))).json();
      if (asked === state.asked) showReply(reply);
    } catch (error) {
      if (asked !== state.asked) return;
      by("told").textContent = "";
      complain(error.message);
    } finally {
      if (asked === state.asked) {
        by("results").classList.remove("waiting");
        by("results").removeAttribute("aria-busy");
      }
    }
  };

  const showReply = (reply) => {
    state.reply = reply;
    by("query").src = reply.preview;
    by("query").hidden = false;
    by("invitation").hidden = true;
    document.querySelector("label[for=file]").textContent = "Choose another";
    const notes = reply.notes.map((note) => note.replace(/^the picture: /, ""));
    by("query-facts").textContent = [`${reply.width} × ${reply.height} pixels`, ...notes].join("; ");
    const agree = reply.matches.filter(({ label }) => label === reply.label).length;
    by("headline").textContent = !reply.matches.length ? "No matches" : reply.label && !by("label").value
      ? `Most likely: ${spoken(reply.label)}` : "Nearest pictures";
    const votes = reply.label && !by("label").value ? `${agree} of ${plural(reply.matches.length, "match").replace("matchs", "matches")} agree; ` : "";
    by("told").textContent = `${votes}found in ${Math.max(1, Math.round(1000 * reply.seconds))} ms`;
    fill(reply.matches, reply.bits);
  };

  const searchWith = (picture) => {
    if (!picture) return;
    state.picture = picture;
    search();
  };
  const searchWithItem = async (item) => {
    try {
      searchWith(await (await ask(`/api/items/${item.id}/preview`)).blob());
    } catch (error) { complain(error.message); }
  };

  // ---- one match with what it shares ----
  const narrow = () => window.matchMedia("(max-width: 780px)").matches;
  const open = (rank) => {
    state.shown = rank;
    if (!by("detail").open) by("detail").showModal();
    detail();
  };
  const step = (by_) => {
    const next = state.shown + by_;
    if (next >= 0 && next < state.reply.matches.length) open(next);
  };
  let pairs = [];
  let looking = new AbortController();
  const drawSome = () => {
    by("drawn").textContent = by("most").value;
    pairs.forEach((pair, k) => { pair.style.display = k < by("most").value ? "" : "none"; });
  };
  const detail = async () => {
    looking.abort(); // Who steps on does not want what the service has not begun.
    looking = new AbortController();
    const { signal } = looking;
    const { matches, bits } = state.reply;
    const rank = state.shown;
    const item = matches[rank];
    const picture = state.picture;
    const still = () => !signal.aborted;
    by("detail-title").textContent = title(item);
    by("detail-facts").textContent = `${item.name} · match ${rank + 1} of ${matches.length} · ${item.distance} of ${bits} bits apart`;
    // Not disabled: a disabled button would lose the focus, and the keyboard its place.
    by("previous").ariaDisabled = rank === 0;
    by("next").ariaDisabled = rank === matches.length - 1;
    by("verdict").textContent = "Looking for shared features …";
    by("stage").classList.add("waiting");
    delete by("stage").dataset.ready;
    by("most").disabled = true;
    pairs = [];
    let url = "";
    try {
      url = await preview(item.id);
      const pictures = await Promise.all([loaded(state.reply.preview), loaded(url)]);
      if (!still()) return;
      const places = Board.show(by("board"), pictures, narrow());
      const shared = await (await ask("/api/shared", form({ image: picture, item: item.id }), signal)).json();
      if (!still()) return;
      pairs = Board.connect(by("board"), places, shared);
      by("verdict").textContent = verdict(shared);
      by("most").max = pairs.length;
      by("most").value = Math.min(40, pairs.length);
      by("most").disabled = !pairs.length;
      drawSome();
      by("stage").dataset.ready = item.id;
    } catch (error) {
      if (still()) by("verdict").textContent = error.message;
    } finally {
      if (url) URL.revokeObjectURL(url);
      if (still()) by("stage").classList.remove("waiting");
    }
  };
  const verdict = ({ score, points, reason }) => {
    if (reason) return sentence(reason);
    const found = `${points.length} features agree on where one picture lies in the other, with evidence ${score.toFixed(1)}`;
    if (score > GREATEST) return `${found}: more than unrelated pictures ever had in our measurements.`;
    return score > USUAL ? `${found}: a hint, as unrelated pictures have about ${USUAL} and at most ${GREATEST}.`
      : `${found}: no more than unrelated pictures have.`;
  };

  // ---- what people do ----
  by("file").addEventListener("change", () => { searchWith(by("file").files[0]); by("file").value = ""; });
  by("label").addEventListener("change", search);
  by("count").addEventListener("change", search);
  by("most").addEventListener("input", drawSome);
  by("previous").addEventListener("click", () => step(-1));
  by("next").addEventListener("click", () => step(1));
  by("detail").addEventListener("close", () => looking.abort());
  by("close").addEventListener("click", () => by("detail").close());
  by("detail").addEventListener("click", (event) => { if (event.target === by("detail")) by("detail").close(); });
  document.addEventListener("keydown", (event) => {
    if (!by("detail").open || event.target === by("most")) return;
    if (event.key === "ArrowLeft") step(-1);
    if (event.key === "ArrowRight") step(1);
  });
  by("again").addEventListener("click", () => {
    const item = state.reply.matches[state.shown];
    by("detail").close();
    window.scrollTo({ top: 0 });
    searchWithItem(item);
  });
  const dragged = (event) => event.dataTransfer && [...event.dataTransfer.types].includes("Files");
  document.addEventListener("dragover", (event) => {
    if (!dragged(event)) return;
    event.preventDefault();
    by("drop").classList.add("over");
  });
  document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) by("drop").classList.remove("over"); });
  document.addEventListener("drop", (event) => {
    if (!dragged(event)) return;
    event.preventDefault();
    by("drop").classList.remove("over");
    searchWith(event.dataTransfer.files[0]);
  });
  document.addEventListener("paste", (event) => {
    const file = [...event.clipboardData.files].find(({ type }) => type.startsWith("image/"));
    if (file) searchWith(file);
  });

  // ---- the start ----
  const start = async () => {
    try {
      state.about = await (await ask("/api/index")).json();
    } catch (error) {
      if (error.status !== 401) { by("main").hidden = false; complain(error.message); return; }
      by("entry").hidden = false;
      by("entry-error").textContent = error.message;
      by("entry-error").hidden = !sessionStorage.getItem("pliant-token");
      by("token").focus();
      return;
    }
    const { items, labels, bits, matches } = state.about;
    const classes = labels.filter(({ label }) => label);
    by("entry").hidden = true;
    by("main").hidden = false;
    by("about").textContent = [plural(items, "picture"), classes.length ? plural(classes.length, "class") : "", `codes of ${bits} bits`].filter(Boolean).join(" · ");
    by("label").append(...classes.map(({ label, items: count }) => {
      const option = element("option", "", `${spoken(label)} (${number(count)})`);
      option.value = label;
      return option;
    }));
    [...by("count").options].forEach((option) => { if (+option.value > matches) option.remove(); });
    by("nothing").hidden = items > 0;
    if (items) await fill(await (await ask("/api/sample?count=12")).json(), 0);
    else by("headline").textContent = "Nothing to search in yet";
    document.documentElement.dataset.ready = "true";
  };
  by("entry").addEventListener("submit", (event) => {
    event.preventDefault();
    sessionStorage.setItem("pliant-token", by("token").value);
    start();
  });
  // A link may carry the token where no server and no log sees it: after the number sign.
  const carried = /^#token=(.+)$/.exec(location.hash);
  if (carried) {
    sessionStorage.setItem("pliant-token", decodeURIComponent(carried[1]));
    history.replaceState(null, "", location.pathname);
  }
  start();
})();
