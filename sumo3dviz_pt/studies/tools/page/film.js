// Shows films: loads each one whole, fits it, plays it once and measures how it was shown.
"use strict";

/** Why a film is not shown. */
class FilmProblem extends Error {
  constructor(kind, message) {
    super(message);
    this.kind = kind;
  }
}

/** Loads films as a whole and ahead of their time, so that none stalls while it plays. */
class Loader {
  constructor(films) {
    this.films = films;
    this.loads = new Map();
  }

  /** Begin to load the next films, one after the other, and let go of all others. */
  async ahead(names) {
    for (const [name, load] of this.loads) {
      if (!names.includes(name)) {
        this.loads.delete(name);
        load.promise.then(({ url }) => URL.revokeObjectURL(url), () => {});
      }
    }
    for (const name of names) await this.get(name).promise.catch(() => {});
  }

  /** A film's load: a promise of its address, and the share that is there. */
  get(name) {
    if (!this.loads.has(name)) {
      const load = { share: 0 };
      load.promise = this.load(this.films[name], load);
      load.promise.catch(() => {});
      this.loads.set(name, load);
    }
    return this.loads.get(name);
  }

  forget(name) {
    this.loads.delete(name);
  }

  async load(film, load) {
    // Pages that lie in a folder without a server cannot ask for files.
    if (location.protocol === "file:") return { url: film.file, certified: "" };
    const patience = new AbortController();
    let timer;
    const alive = () => {
      clearTimeout(timer);
      timer = setTimeout(() => patience.abort(), 30_000);
    };
    alive();
    try {
      // What the browser kept from before counts only if the server still has the same.
      const reply = await fetch(film.file, { signal: patience.signal, cache: film.cache ?? "no-cache" });
      if (!reply.ok) throw new FilmProblem("missing", `${film.file}: ${reply.status}`);
      const size = Number(reply.headers.get("Content-Length"));
      const parts = [];
      let there = 0;
      for (const reader = reply.body.getReader();;) {
        const { done, value } = await reader.read();
        if (done) break;
        alive();
        parts.push(value);
        there += value.length;
        load.share = size ? there / size : 0;
      }
      const type = film.file.endsWith(".webm") ? "video/webm" : "video/mp4";
      const blob = new Blob(parts, { type });
      return { url: URL.createObjectURL(blob), certified: await this.isCertified(film, blob) };
    } catch (error) {
      if (error instanceof FilmProblem) throw error;
      throw new FilmProblem("not loaded", `${film.file}: ${error.message}`);
    } finally {
      clearTimeout(timer);
    }
  }

  /** Whether a film is the one that the study was made with; browsers only tell over https. */
  async isCertified(film, blob) {
    if (!film.digest || !crypto.subtle) return "";
    const bytes = new Uint8Array(await crypto.subtle.digest("SHA-256", await blob.arrayBuffer()));
    const digest = [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    return digest === film.digest ? 1 : 0;
  }
}

/** Counts an event and how long it lasted. */
class Spell {
  constructor() {
    this.count = 0;
    this.total = 0;
    this.since = null;
  }

  begin(now = performance.now()) {
    if (this.since !== null) return;
    this.count += 1;
    this.since = now;
  }

  end(now = performance.now()) {
    if (this.since === null) return;
    this.total += now - this.since;
    this.since = null;
  }

  get ms() {
    return Math.round(this.total + (this.since === null ? 0 : performance.now() - this.since));
  }
}

/** Notes when the page was hidden or had no focus. */
class Watch {
  constructor() {
    this.hidden = new Spell();
    this.blurred = new Spell();
    this.stop = new AbortController();
    const { signal } = this.stop;
    const look = () => document.hidden ? this.hidden.begin() : this.hidden.end();
    look();
    document.addEventListener("visibilitychange", look, { signal });
    addEventListener("blur", () => this.blurred.begin(), { signal });
    addEventListener("focus", () => this.blurred.end(), { signal });
  }

  end() {
    this.stop.abort();
    return {
      page_hidden: this.hidden.count,
      page_hidden_ms: this.hidden.ms,
      page_blurred: this.blurred.count,
      page_blurred_ms: this.blurred.ms,
      browser: navigator.userAgent,
      window_width: innerWidth,
      window_height: innerHeight,
      pixel_ratio: devicePixelRatio,
    };
  }
}

/** The frames that came to the screen: the film's time of each, and when it was seen. */
class Frames {
  constructor(video, film) {
    this.video = video;
    this.step = film.duration / film.frames;
    this.count = film.frames;
    this.seen = [];
    this.isExact = "requestVideoFrameCallback" in video;
    const note = (_, { mediaTime, expectedDisplayTime, presentedFrames }) => {
      this.seen.push({ film: mediaTime, at: expectedDisplayTime, number: presentedFrames });
      video.requestVideoFrameCallback(note);
    };
    if (this.isExact) video.requestVideoFrameCallback(note);
  }

  /** When the first frame was seen; by the browser's own word where it cannot tell frames. */
  start(playing) {
    return this.seen.length ? this.seen[0].at : playing;
  }

  /** The film's time on the screen at a moment [s]. */
  at(moment, fallback) {
    if (!this.isExact) return fallback;
    const found = this.seen.findLast(({ at }) => at <= moment);
    return found ? found.film : 0;
  }

  number(time) {
    return Math.min(this.count - 1, Math.max(0, Math.round(time / this.step)));
  }

  /** Frames that never came, and times at which one stood for another; pauses are no such. */
  counted(pauses) {
    if (!this.seen.length) return { film_frames_dropped: "", film_frames_repeated: "" };
    const last = this.seen[this.seen.length - 1];
    const came = last.number - this.seen[0].number + 1;
    let repeated = 0;
    for (let place = 1; place < this.seen.length; place += 1) {
      const [before, now] = [this.seen[place - 1], this.seen[place]];
      const isPaused = pauses.some(([from, to]) => from < now.at && to > before.at);
      const late = (now.at - before.at) / 1000 - (now.film - before.film);
      if (!isPaused) repeated += Math.max(0, Math.round(late / this.step));
    }
    return {
      film_frames_dropped: Math.max(0, this.count - came),
      film_frames_repeated: repeated,
    };
  }
}

const KEYS = { " ": "space" };

/** Keys and a button that people press while a film plays, each at a moment. */
class Presses {
  constructor(during, place) {
    this.all = [];
    this.isOpen = false;
    this.stop = new AbortController();
    if (!during) return;
    const { signal } = this.stop;
    const named = (event) => KEYS[event.key] ?? event.key.toLowerCase();
    const down = (what, event) => {
      event.preventDefault();
      if (this.isOpen) this.all.push({ what, at: event.timeStamp, until: null, film: this.now() });
    };
    const up = (what, event) => {
      const open = this.all.findLast((press) => press.what === what && press.until === null);
      if (open) open.until = event.timeStamp;
    };
    document.addEventListener("keydown", (event) => {
      const key = named(event);
      if (during.keys.includes(key) && !event.repeat) down(key, event);
      else if (during.keys.includes(key)) event.preventDefault();
    }, { signal });
    document.addEventListener("keyup", (event) => up(named(event), event), { signal });
    const button = place.querySelector(".during button");
    if (!button) return;
    button.addEventListener("pointerdown", (event) => down("button", event), { signal });
    for (const name of ["pointerup", "pointercancel", "pointerleave"]) {
      button.addEventListener(name, (event) => up("button", event), { signal });
    }
  }

  /** Rows of the data: film times in seconds, in order, parted by semicolons. */
  told(frames, start) {
    this.stop.abort();
    const times = this.all.map(({ at, film }) => frames.at(at, film));
    const listed = (values) => values.join(";");
    return {
      presses: this.all.length,
      press_keys: listed(this.all.map(({ what }) => what)),
      press_film_times: listed(times.map((time) => time.toFixed(3))),
      press_frames: listed(times.map((time) => frames.number(time))),
      press_rt_start: listed(this.all.map(({ at }) => Math.round(at - start))),
      press_held_ms: listed(this.all.map(({ at, until }) =>
        until === null ? "" : Math.round(until - at))),
    };
  }
}

/** One showing of a film in an element of the page. */
class Showing {
  /**
   * @param place  Element with .stage, where the film is; it may have .during, a button.
   * @param show   {name, film, loader, words, width, during}
   */
  constructor(place, show) {
    this.place = place;
    this.stage = place.querySelector(".stage");
    this.show = show;
    this.retries = 0;
    this.problems = [];
  }

  /** Show the film until it has ended or is given up; return what there is to say of it. */
  async run() {
    const begun = performance.now();
    for (;;) {
      try {
        const load = await this.loaded();
        const ready = performance.now();
        const shown = await this.played(load);
        return { ...this.history(), film_loading_ms: Math.round(ready - begun), ...shown };
      } catch (error) {
        if (!(error instanceof FilmProblem)) throw error;
        this.problems.push(error.kind);
        console.warn(error.kind, error.message);
        if (!await this.again()) return { ...this.history(), film_skipped: 1 };
        this.retries += 1;
        this.show.film.cache = "reload";
        this.show.loader.forget(this.show.name);
      }
    }
  }

  history() {
    return {
      film_skipped: 0, film_retries: this.retries, film_problems: this.problems.join(";"),
    };
  }

  async loaded() {
    const load = this.show.loader.get(this.show.name);
    this.stage.innerHTML = `<p class="loading"></p>`;
    const said = this.stage.firstChild;
    const tell = () => {
      said.textContent = `${this.show.words.loading} ${Math.floor(100 * load.share)} %`;
    };
    tell();
    const timer = setInterval(tell, 200);
    try {
      return await load.promise;
    } finally {
      clearInterval(timer);
    }
  }

  /** Tell that a film cannot be shown; true if it is to be tried again. */
  again() {
    const { words } = this.show;
    this.stage.innerHTML = `<div class="problem"><p>${text(words.problem)}</p>`
      + `<div class="buttons"><button class="jspsych-btn" name="retry">${text(words.retry)}</button>`
      + `<button class="jspsych-btn" name="skip">${text(words.skip)}</button></div></div>`;
    return new Promise((done) => {
      for (const button of this.stage.querySelectorAll("button")) {
        button.addEventListener("click", () => done(button.name === "retry"));
      }
    });
  }

  /** As wide as it is to be, but never larger than the window leaves room for. */
  fit() {
    const { video } = this;
    const [wide, high] = this.show.film.size ?? [video.videoWidth || 16, video.videoHeight || 9];
    const others = this.place.scrollHeight - this.stage.offsetHeight;
    const room = Math.max(120, innerHeight - others - 8);
    const wanted = this.show.width ?? wide;
    const width = Math.min(wanted, document.documentElement.clientWidth - 16, room * wide / high);
    video.style.width = `${width}px`;
    video.style.height = `${width * high / wide}px`;
    this.fitted = width < wanted - 0.5 ? 1 : 0;
  }

  async played({ url, certified }) {
    const { film, words, during } = this.show;
    const video = this.video = document.createElement("video");
    Object.assign(video, {
      muted: !film.heard, playsInline: true, disablePictureInPicture: true, preload: "auto",
    });
    if (!film.heard) video.setAttribute("muted", "");
    video.setAttribute("playsinline", "");
    video.addEventListener("contextmenu", (event) => event.preventDefault());
    this.stage.replaceChildren(video);
    this.fit();
    const stop = new AbortController();
    const { signal } = stop;
    addEventListener("resize", () => this.fit(), { signal });

    const [frames, watch, paused, stalled] = [
      new Frames(video, film), new Watch(), new Spell(), new Spell()];
    const presses = new Presses(during, this.place);
    presses.now = () => video.currentTime;
    const pauses = [];
    let playing = null, isOver = false;
    const when = (name, act) => video.addEventListener(name, act, { signal });
    when("loadedmetadata", () => this.fit());
    when("playing", () => {
      playing ??= performance.now();
      stalled.end();
      presses.isOpen = true;
    });
    when("waiting", () => playing !== null && stalled.begin());
    when("pause", () => {
      if (video.ended || isOver) return;
      paused.begin();
      pauses.push([performance.now(), Infinity]);
      this.offer(words.go_on, () => video.play());
    });
    when("play", () => {
      this.stage.querySelector(".buttons")?.remove();
      paused.end();
      if (pauses.length) pauses[pauses.length - 1][1] = performance.now();
    });
    try {
      await new Promise((done, failed) => {
        when("ended", done);
        when("error", () => failed(
          new FilmProblem("undecodable", `${film.file}: ${video.error?.message}`)));
        this.guard(video, failed, signal);
        video.src = url;
        video.play().catch((error) => {
          if (error.name !== "NotAllowedError") return;  // an error event says the others
          this.offer(words.play, () => video.play());
        });
      });
    } catch (error) {
      watch.end();
      presses.stop.abort();
      this.stage.replaceChildren();
      throw error;
    } finally {
      isOver = true;
      stop.abort();
    }
    const end = performance.now();
    presses.isOpen = false;
    // The last frame is told of after the end.
    await new Promise((done) => setTimeout(done, 60));
    const start = frames.start(playing ?? end);
    this.times = { start, end };
    return {
      film_ms: Math.round(end - start),
      film_certified: certified,
      film_paused: paused.count,
      film_paused_ms: paused.ms,
      film_stalled: stalled.count,
      film_stalled_ms: stalled.ms,
      ...frames.counted(pauses),
      film_clock: frames.isExact ? "frames" : "currentTime",
      film_hidden_ms: watch.hidden.ms,
      film_width: Math.round(video.getBoundingClientRect().width),
      film_fitted: this.fitted,
      ...(during ? presses.told(frames, start) : {}),
      ...watch.end(),
    };
  }

  /** A button over the film, for what a browser does not do by itself. */
  offer(words, act) {
    const box = document.createElement("div");
    box.className = "buttons";
    box.innerHTML = `<button class="jspsych-btn" name="play">${text(words)}</button>`;
    box.firstChild.addEventListener("click", () => {
      box.remove();
      act();
    });
    this.stage.querySelector(".buttons")?.remove();
    this.stage.append(box);
  }

  /** A film that stands still for ten seconds, and that nobody paused, is a problem. */
  guard(video, failed, signal) {
    let [last, since] = [-1, performance.now()];
    const timer = setInterval(() => {
      const isWaiting = this.stage.querySelector(".buttons") || document.hidden;
      if (video.currentTime !== last || isWaiting) {
        [last, since] = [video.currentTime, performance.now()];
      } else if (performance.now() - since > 10_000) {
        failed(new FilmProblem("stands still", this.show.film.file));
      }
    }, 500);
    signal.addEventListener("abort", () => clearInterval(timer));
  }
}
