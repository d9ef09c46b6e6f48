// Keeps what happened in the browser, so that a reload loses nothing, and sends it on.
"use strict";

/** Text as HTML shows it. */
const text = (words) => {
  const element = document.createElement("span");
  element.textContent = words;
  return element.innerHTML;
};

/** A time of day with its offset from UTC, such as 2026-11-27T10:05:00.123+01:00. */
const timeOfDay = (date = new Date()) => {
  const offset = -date.getTimezoneOffset();
  const two = (number) => String(Math.floor(Math.abs(number))).padStart(2, "0");
  const local = new Date(date.getTime() + offset * 60_000).toISOString().slice(0, -1);
  return `${local}${offset < 0 ? "-" : "+"}${two(offset / 60)}:${two(offset % 60)}`;
};

const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;

/** A cell of a table; what a spreadsheet would compute begins with an apostrophe. */
const cell = (value) => {
  let words = typeof value === "object" && value !== null ? JSON.stringify(value)
    : String(value ?? "");
  if (/^[=+\-@\t\r]/.test(words) && !NUMBER.test(words)) words = `'${words}`;
  return /[",\r\n]/.test(words) ? `"${words.replaceAll('"', '""')}"` : words;
};

/** Rows as a table with the columns of all of them. */
const tableOf = (rows) => {
  const columns = [...new Set(rows.flatMap((row) => Object.keys(row)))];
  const lines = [columns, ...rows.map((row) => columns.map((column) => row[column]))];
  return lines.map((line) => line.map(cell).join(",")).join("\n") + "\n";
};

/** The browser's own memory; the page's, where that is forbidden. */
const memory = (() => {
  try {
    localStorage.setItem("sumo3dviz:try", "1");
    localStorage.removeItem("sumo3dviz:try");
    return localStorage;
  } catch {
    const own = new Map();
    return {
      getItem: (key) => own.get(key) ?? null,
      setItem: (key, value) => own.set(key, value),
      removeItem: (key) => own.delete(key),
    };
  }
})();

/** What one person did so far: the steps that are behind them, and all rows of data. */
class Run {
  constructor(key, common) {
    this.key = key;
    this.common = common;
    const kept = memory.getItem(key);
    this.state = kept ? JSON.parse(kept) : {
      visit: crypto.getRandomValues(new Uint32Array(2)).join("-"),
      loads: 0, sent: 0, rows: [], begun: {}, past: [], done: false, kept: {},
    };
  }

  save() {
    try {
      memory.setItem(this.key, JSON.stringify(this.state));
    } catch (error) {
      console.warn("The browser's memory is full; answers are kept by this page only.", error);
    }
  }

  forget() {
    memory.removeItem(this.key);
  }

  /** Add a row of data; it is kept before anything else happens. */
  add(row) {
    this.state.rows.push({
      ...this.common, visit: this.state.visit, visit_row: this.state.rows.length + 1,
      page_loads: this.state.loads, page_time: timeOfDay(), ...row,
    });
    this.save();
    this.on_add?.();
  }

  /** Count how often a step was begun: more than once after a reload. */
  begin(step) {
    this.state.begun[step] = (this.state.begun[step] ?? 0) + 1;
    this.save();
    return this.state.begun[step];
  }

  get name() {
    const { participant, playlist } = this.common;
    return `answers_${participant || this.state.visit}_playlist_${playlist}.csv`;
  }

  download() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([tableOf(this.state.rows)], { type: "text/csv" }));
    link.download = this.name;
    link.click();
  }
}

const PATIENCE_MS = 20_000;

const answered = async (url, options) => {
  // What is on its way arrives even if the page is closed meanwhile.
  const signal = AbortSignal.timeout(PATIENCE_MS);
  const reply = await fetch(url, { ...options, keepalive: true, signal });
  if (!reply.ok) throw new Error(`${url}: ${reply.status} ${await reply.text()}`);
  return reply;
};

const posted = (url, content) => answered(url, {
  method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content),
});

const nameOf = (row) => `${row.visit}_${String(row.visit_row).padStart(4, "0")}`;

/** How a row gets to each kind of endpoint; each gives a promise that fails if it did not. */
const SENDERS = {
  post: (to, row) => posted(to.url, row),
  jatos: (to, row) => jatos.appendResultData(`${JSON.stringify(row)}\n`),
  // A file for each row; one that is there already was sent before the answer got lost.
  datapipe: (to, row) => posted(to.url, {
    experimentID: to.experiment,
    filename: `${nameOf(row)}.json`,
    data: JSON.stringify(row),
  }).catch((error) => {
    if (!error.message.includes("OSF_FILE_EXISTS")) throw error;
  }),
  pavlovia: async (to, row, kept) => {
    const sessions = `${to.url}api/v2/experiments/${to.experiment}/sessions`;
    kept.token ??= (await (await answered(sessions, { method: "POST" })).json()).token;
    const form = new FormData();
    form.append("key", `${nameOf(row)}.csv`);
    form.append("value", tableOf([row]));
    await answered(`${sessions}/${kept.token}/results`, { method: "POST", body: form });
  },
};

/** Sends rows one by one, in order; what fails is tried again, after a reload, too. */
class Sender {
  constructor(run, endpoint) {
    this.run = run;
    this.endpoint = endpoint;
    this.isBusy = false;
    this.wait = 500;
    this.timer = null;
    addEventListener("online", () => this.send());
  }

  get left() {
    return this.endpoint ? this.run.state.rows.length - this.run.state.sent : 0;
  }

  async send() {
    if (this.isBusy || !this.left) return;
    clearTimeout(this.timer);
    this.isBusy = true;
    const { state } = this.run;
    try {
      while (this.left) {
        await SENDERS[this.endpoint.kind](this.endpoint, state.rows[state.sent], state.kept);
        state.sent += 1;
        this.wait = 500;
        this.run.save();
      }
    } catch (error) {
      console.warn("An answer could not be sent yet:", error);
      this.timer = setTimeout(() => this.send(), this.wait);
      this.wait = Math.min(60_000, 2 * this.wait);
    } finally {
      this.isBusy = false;
    }
  }

  /** Wait until all is sent; false if it is not after a while. */
  async all(patience = PATIENCE_MS) {
    const end = performance.now() + patience;
    this.send();
    while (this.left && performance.now() < end) {
      await new Promise((done) => setTimeout(done, 50));
    }
    return !this.left;
  }
}
