// What a person goes through on the page: consent, forms, practice, films and questions.
"use strict";

const study = JSON.parse(document.getElementById("study").textContent);
const words = study.texts;

/** Show a sentence, and buttons with what they do. */
const notice = (sentence, ...buttons) => {
  document.body.innerHTML = `<div class="notice"><p>${text(sentence)}</p></div>`;
  for (const [label, act] of buttons) {
    const button = document.createElement("button");
    button.className = "jspsych-btn";
    button.textContent = label;
    button.addEventListener("click", act);
    document.body.firstChild.append(button, " ");
  }
};

// Without the network, or where an address is blocked, scripts are missing and only we can say it.
if (typeof initJsPsych === "undefined") {
  notice(study.missing);
  throw new Error(study.missing);
}

const buttonsOf = (labels, { disabled = false } = {}) => labels.map((label, place) =>
  `<button class="jspsych-btn" data-place="${place}"${disabled ? " disabled" : ""}>`
  + `${text(label)}</button>`).join("");
const endsOf = ({ low, high }) => low || high
  ? `<p class="ends"><span>${text(low)}</span><span>${text(high)}</span></p>` : "";

/** A click on one of some buttons: its place, and when it was. */
const clickIn = (place) => new Promise((done) => {
  for (const button of place.querySelectorAll("button[data-place]")) {
    button.addEventListener("click", (event) => done({
      choice: Number(button.dataset.place), at: event.timeStamp,
    }));
  }
});

const plugin = (name, act) => class {
  static info = {
    name, version: "1.0.0", data: {},
    parameters: { show: { type: jsPsychModule.ParameterType.OBJECT, default: {} } },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  trial(display, { show }) {
    act(display, show).then((row) => {
      display.innerHTML = "";
      this.jsPsych.finishTrial(row);
    });
  }
};

/** What is pressed during a film: its button, if there is one, and a sentence that names all. */
const pressed = () => {
  const { during } = study;
  if (!during) return { button: null, sentence: "" };
  const isTouched = matchMedia("(pointer: coarse)").matches;
  const button = during.button ?? (isTouched ? words.press : null);
  const named = during.keys.map((key) => key === "space" ? words.key_space : key.toUpperCase());
  const keys = named.length < 2 ? named.join("")
    : `${named.slice(0, -1).join(", ")} ${words.key_or} ${named[named.length - 1]}`;
  // Where a finger is the pointer there may be no keys.
  const said = !button ? words.press_keys : isTouched || !keys ? words.press_button
    : words.press_keys_or_button;
  const sentence = said.replace("{keys}", () => keys).replace("{button}", () => button);
  return { button, sentence };
};

/** The same with what it is pressed for. */
const pressedFor = () => [study.during?.text, pressed().sentence].filter(Boolean).join("\n");

/** A film, and a question about it as soon as it has ended; without a question it goes on. */
const FilmPlugin = plugin("film", async (display, show) => {
  const { asked } = show;
  const { button, sentence } = pressed();
  const during = show.during && { ...show.during, button };
  // A rest right before the film has said the same.
  const isTold = during && !show.isRested;
  display.innerHTML = `<div class="show">${show.letter ? `<h2>${text(show.letter)}</h2>` : ""}`
    + (isTold && during.text ? `<p>${text(during.text)}</p>` : "")
    + (isTold ? `<p class="keys">${text(sentence)}</p>` : "")
    + `<div class="stage"></div><p>${text(show.told)}</p>`
    + (during?.button ? `<div class="buttons during"><button>${text(during.button)}</button></div>` : "")
    + (asked ? `<p>${text(asked.text)}</p><div class="scale">${endsOf(asked)}`
      + `<div class="buttons ask">${buttonsOf(asked.answers, { disabled: true })}</div></div>` : "")
    + "</div>";
  const place = display.querySelector(".show");
  const showing = new Showing(place, show);
  const row = await showing.run();
  if (!asked || row.film_skipped) return row;
  const watch = new Watch();
  const ask = place.querySelector(".ask");
  for (const button of ask.children) button.disabled = false;
  const { choice, at } = await clickIn(ask);
  const { page_hidden, page_hidden_ms, page_blurred, page_blurred_ms } = watch.end();
  return {
    ...row,
    answer: asked.answers[choice],
    rt_start: Math.round(at - showing.times.start),
    rt_end: Math.round(at - showing.times.end),
    page_hidden: row.page_hidden + page_hidden,
    page_hidden_ms: row.page_hidden_ms + page_hidden_ms,
    page_blurred: row.page_blurred + page_blurred,
    page_blurred_ms: row.page_blurred_ms + page_blurred_ms,
  };
});

const itemOf = (item, place, form) => {
  const answers = item.answers ?? form.answers ?? [];
  const name = `item_${place}`;
  if (!answers.length) {
    return `<fieldset><label for="${name}">${text(item.text)}</label>`
      + `<textarea id="${name}" name="${name}"></textarea></fieldset>`;
  }
  const radios = answers.map((answer) => `<label><input type="radio" name="${name}" required `
    + `value="${text(answer).replaceAll('"', "&quot;")}">${text(answer)}</label>`).join("");
  return `<fieldset><legend>${text(item.text)}</legend>`
    + `<div class="scale">${endsOf({ low: item.low ?? form.low, high: item.high ?? form.high })}`
    + `<div class="answers">${radios}</div></div></fieldset>`;
};

/** Questions that stand on one page, or words and buttons alone. */
const FormPlugin = plugin("form", async (display, show) => {
  const { form } = show;
  display.innerHTML = `<form class="form">${form.title ? `<h1>${text(form.title)}</h1>` : ""}`
    + `<p class="intro">${text(form.intro ?? "")}</p>${form.html ?? ""}`
    + (form.items ?? []).map((item, place) => itemOf(item, place, form)).join("")
    + `<div class="buttons">${buttonsOf(form.buttons)}</div></form>`;
  const [begun, watch] = [performance.now(), new Watch()];
  const page = display.querySelector("form");
  page.addEventListener("submit", (event) => event.preventDefault());
  form.begin?.(page);
  for (;;) {
    const { choice, at } = await clickIn(page.querySelector(".buttons"));
    if (!page.reportValidity()) continue;
    const given = new FormData(page);
    const answers = Object.fromEntries((form.items ?? []).map((_, place) =>
      [`${form.name}_${place + 1}`, given.get(`item_${place}`) ?? ""]));
    return { ...answers, choice, rt_shown: Math.round(at - begun), ...watch.end() };
  }
});

// Steps -------------------------------------------------------------------------------------

/** The right size: width = 2 D tan(fov / 2), in pixels of this screen. */
const widthOf = (film, perCm) => study.screen && perCm && film.fov
  ? 200 * study.screen.distance * Math.tan(film.fov * Math.PI / 360) * perCm : null;

/** What of a trial's data is ours and not jsPsych's. */
const ownOf = ({ trial_type, trial_index, time_elapsed, plugin_version, ...own }) => own;

/** Makes the steps of one person; each is an array of jsPsych's trials. */
class Steps {
  constructor(run, loader, asked) {
    this.run = run;
    this.loader = loader;
    const { kept } = run.state;
    kept.px_per_cm ??= parseFloat(asked.get("px_per_cm")) || study.screen?.pixels_per_cm || null;
  }

  /** A form whose row is added when it is done. */
  form(form, kind, { on_row = () => ({}) } = {}) {
    return {
      type: FormPlugin,
      show: { form: { buttons: [words.next], ...form } },
      on_finish: (data) => {
        const { choice, ...own } = ownOf(data);
        this.run.add({ row_kind: kind, page_form: form.name ?? kind, ...on_row(choice, own), ...own });
      },
    };
  }

  /** A bank card on the screen tells how large its pixels are. */
  screen() {
    const [wide, high] = study.screen.card;
    const { kept } = this.run.state;
    return this.form({
      name: "screen",
      intro: study.screen.instruction,
      html: '<div id="card"></div><p><input id="size" type="range" min="100" max="1200" step="1" '
        + 'value="324" style="width: 100%"></p>',
      begin: (page) => {
        const [slider, card] = [page.querySelector("#size"), page.querySelector("#card")];
        const draw = () => {
          card.style.width = `${slider.value}px`;
          card.style.height = `${slider.value * high / wide}px`;
          kept.px_per_cm = slider.value / wide;
        };
        slider.addEventListener("input", draw);
        draw();
      },
    }, "screen", { on_row: () => ({ px_per_cm: kept.px_per_cm }) });
  }

  /** A question with a given answer tells whether people read. */
  attention(number) {
    const { answers, low, high } = study.question;
    const wanted = answers[(3 * number + 1) % answers.length];
    return this.form({
      name: "attention",
      items: [{ text: words.attention.replace("{answer}", () => wanted), answers, low, high }],
    }, "attention", {
      on_row: (_, data) => ({
        attention_wanted: wanted, attention_passed: data.attention_1 === wanted ? 1 : 0,
      }),
    });
  }

  film(name, more) {
    const film = study.films[name];
    return {
      type: FilmPlugin,
      on_start: (trial) => {
        trial.show = {
          name, film, loader: this.loader, words, told: "",
          width: widthOf(film, this.run.state.kept.px_per_cm), ...more,
        };
      },
      show: {},
    };
  }

  /** A rest before a film that nothing is asked after; it is no row of the data. */
  rest(position) {
    const { number, count } = position;
    const title = number && words.film_of.replace("{number}", () => number)
      .replace("{count}", () => count);
    return {
      type: FormPlugin,
      // Only now is it known whether the screen is touched, as for the film.
      on_start: (trial) => {
        trial.show = {
          form: {
            title, intro: pressedFor(), buttons: [words.ready],
            begin: (page) => page.querySelector("button").focus(),
          },
        };
      },
      show: {},
    };
  }

  /** The trials of a step; `kind` is `answer`, or `practice`. */
  trial(trial, kind, position, step, isAgain = false) {
    const common = () => ({
      ...trial.data, position, repeated: isAgain ? 1 : 0,
      px_per_cm: this.run.state.kept.px_per_cm ?? "",
    });
    const { during } = study;
    if (trial.films.length === 1) {
      const [name] = trial.films;
      const asked = during?.only ? null : study.question;
      const shown = this.film(name, {
        during, asked, told: trial.told[0], isRested: Boolean(during?.only),
      });
      const count = study.playlists[this.run.common.playlist].length;
      return [...(during?.only ? [this.rest({ number: position, count })] : []), {
        ...shown,
        on_finish: (data) => this.run.add({
          row_kind: kind, ...common(), attempt: this.run.state.begun[step], answer: "", rt_start: "",
          rt_end: "", ...ownOf(data),
        }),
      }];
    }
    return this.choice(trial, kind, common, step);
  }

  /** Several films, one after the other or on one card, then a choice among them. */
  choice(trial, kind, common, step) {
    let [skipped, end, start] = [0, 0, null];
    const films = trial.card ? [[trial.card, ""]] : trial.films.flatMap((name, place) =>
      name === null ? [] : [[name, study.letters[place], trial.told[place]]]);
    const shown = films.map(([name, letter, told], place) => ({
      ...this.film(name, { during: study.during, letter, told: told ?? "" }),
      on_finish: (data) => {
        skipped += data.film_skipped;
        end = performance.now();
        start ??= end - (data.film_ms ?? 0);
        this.run.add({
          row_kind: trial.card ? "card" : "film", film: name, film_place: place + 1, ...common(),
          attempt: this.run.state.begun[step], ...ownOf(data),
        });
      },
    }));
    const told = trial.told.flatMap((each, place) =>
      each ? [`${study.letters[place]}: ${each}`] : []).join("\n");
    const labels = trial.films.map((name, place) => name === null
      ? study.question.none : study.letters[place]);
    return [...shown, this.form({
      name: "choice", intro: [study.question.choice, told].join("\n"), buttons: labels,
    }, kind, {
      on_row: (place) => ({
        ...common(), attempt: this.run.state.begun[step], answer: place + 1,
        chosen: trial.films[place] ?? "", films_skipped: skipped,
        rt_start: Math.round(performance.now() - start),
        rt_end: Math.round(performance.now() - end),
      }),
    })];
  }

  /** All steps in order: each with a name, the films that it needs, and its trials. */
  all(playlist) {
    const { session } = study;
    const trials = study.playlists[playlist].map((each) => study.trials[each]);
    const filmsOf = (trial) => trial.card ? [trial.card] : trial.films.filter((name) => name);
    const forms = (list, part) => list.map((form) => ({
      name: `${part} ${form.name}`, films: [],
      make: () => [this.form(form, "form", { on_row: () => ({ page_part: part }) })],
    }));
    const said = (name, intro) => ({
      name, films: [], make: () => [this.form({ name, intro }, "page")],
    });
    const practised = trials.slice(trials.length - session.practice).reverse();
    const practice = practised.map((trial, place) => ({
      name: `practice ${place + 1}`, films: filmsOf(trial),
      make: (step) => this.trial(trial, "practice", "", step),
    }));
    const main = trials.map((trial, place) => ({
      name: `trial ${place + 1}`, films: filmsOf(trial),
      make: (step) => this.trial(trial, "answer", place + 1, step, trials.indexOf(trial) < place),
    }));
    // Checks stand evenly between the trials.
    for (let number = session.attention; number > 0; number -= 1) {
      const after = Math.round(number * trials.length / (session.attention + 1));
      main.splice(after, 0, {
        name: `attention ${number}`, films: [], make: () => [this.attention(number)],
      });
    }
    // After consent the start page, which names the keys, does not come.
    const isTold = session.consent === null || !study.during || study.during.only;
    return [
      ...(isTold ? [] : [said("keys", pressedFor())]),
      ...(study.screen && !this.run.state.kept.px_per_cm
        ? [{ name: "screen", films: [], make: () => [this.screen()] }] : []),
      ...forms(session.before, "before"),
      ...(practice.length ? [said("practice", words.practice), ...practice,
        said("begin", words.begin)] : []),
      ...main,
      ...forms(session.after, "after"),
    ];
  }
}

// A person's visit --------------------------------------------------------------------------

/** The playlist: named in the address, begun here before, by the number, or by chance. */
const playlistFor = (asked, participant, begun) => {
  const names = Object.keys(study.playlists);
  const number = parseInt(participant, 10);
  if (asked.has("playlist")) return asked.get("playlist");
  if (begun && begun in study.playlists) return begun;
  if (Number.isInteger(number)) return names[((number - 1) % names.length + names.length) % names.length];
  return names[Math.floor(Math.random() * names.length)];
};

/** Say thank you when all answers are where they belong, and what to do when they are not. */
const finish = async (run, sender, asked) => {
  notice(words.saving);
  const isSent = await sender.all();
  window.answers = run.state.rows;
  const download = [words.download, () => run.download()];
  if (study.endpoint) {
    if (isSent) return study.endpoint.kind === "jatos" ? jatos.endStudy() : notice(words.end);
    const again = [words.send_again, () => finish(run, sender, asked)];
    return notice(words.unsent, again, download);
  }
  if (asked.get("save") !== "no") run.download();
  return notice(words.end, download);
};

/** Who opens the page again after the end chooses what happens. */
const reopened = (run, sender, asked, begin) => {
  window.answers = run.state.rows;
  sender.send();
  notice(words.finished, [words.download, () => run.download()], [words.anew, () => {
    if (sender.left) return finish(run, sender, asked);
    run.forget();
    begin.forget();
    return location.reload();
  }]);
};

/** Wait until no other window shows the same: each would write over what the other keeps. */
const alone = (name) => new Promise((done) => {
  if (!navigator.locks) return done();  // a page without https
  let isNoted = false;
  const timer = setTimeout(() => {
    isNoted = true;
    notice(words.elsewhere);
  }, 1000);
  return navigator.locks.request(name, () => {
    clearTimeout(timer);
    if (isNoted) document.body.innerHTML = "";
    done();
    return new Promise(() => {});
  });
});

const visit = async () => {
  const { endpoint } = study;
  if (endpoint?.kind === "jatos" && typeof jatos === "undefined") return notice(words.no_jatos);
  if (endpoint?.kind === "jatos") await new Promise((done) => jatos.onLoad(done));
  const asked = new URLSearchParams(location.search);
  if (endpoint?.kind === "jatos") {
    for (const [name, value] of Object.entries(jatos.urlQueryParameters ?? {})) asked.set(name, value);
  }
  const participant = ["participant", "PROLIFIC_PID", "workerId"].map((name) => asked.get(name))
    .find((value) => value) ?? "";
  const place = `sumo3dviz:${study.digest}:${participant}`;
  const begin = { forget: () => memory.removeItem(place) };
  const playlist = playlistFor(asked, participant, memory.getItem(place));
  if (!(playlist in study.playlists)) {
    return notice(words.no_playlist.replace("{name}", () => playlist));
  }
  await alone(`${place}:${playlist}`);
  const run = new Run(`${place}:${playlist}`, { participant, playlist, study_digest: study.digest });
  const sender = new Sender(run, endpoint);
  if (run.state.done) return reopened(run, sender, asked, begin);
  memory.setItem(place, playlist);
  run.state.loads += 1;
  run.on_add = () => sender.send();
  sender.send();
  const jsPsych = initJsPsych();
  const steps = new Steps(run, new Loader(study.films), asked);
  const isAnew = run.state.rows.length === 0;
  const opening = opened(run, steps, isAnew, jsPsych);
  const rest = steps.all(playlist);
  const names = (from) => [...new Set(rest.slice(from).flatMap((step) => step.films))].slice(0, 3);
  const left = rest.map((step, number) => ({ step, number }))
    .filter(({ step }) => !run.state.past.includes(step.name));
  // The first films are loaded while people read.
  if (left.length) steps.loader.ahead(names(left[0].number));
  const timeline = left.map(({ step, number }) => ({
    timeline: step.make(step.name),
    on_timeline_start: () => {
      run.begin(step.name);
      steps.loader.ahead(names(number));
    },
    on_timeline_finish: () => {
      if (!run.state.left) run.state.past.push(step.name);
      run.save();
    },
  }));
  await jsPsych.run([...opening, ...timeline]);
  if (run.state.left) {
    run.forget();
    begin.forget();
    return notice(words.declined);
  }
  run.state.done = true;
  run.add({ row_kind: "end" });
  return finish(run, sender, asked);
};

/** The first page: consent, or a start; after a reload, a word that it goes on. */
const opened = (run, steps, isAnew, jsPsych) => {
  const { consent } = study.session;
  const title = study.title;
  if (!isAnew) {
    const intro = [words.again, pressedFor()].filter(Boolean).join("\n");
    return [steps.form({ title, intro, buttons: [words.resume] }, "start")];
  }
  if (consent === null) return [steps.form({ title, intro: pressedFor(), buttons: [words.start] }, "start")];
  const form = { name: "consent", title, intro: consent, buttons: [words.agree, words.decline] };
  return [{
    ...steps.form(form, "consent"),
    on_finish: ({ choice, rt_shown }) => {
      // Of who does not agree, nothing is kept or sent.
      if (choice === 0) {
        run.add({ row_kind: "consent", answer: "agreed", rt_shown });
        return;
      }
      run.state.left = true;
      jsPsych.abortExperiment();
    },
  }];
};

visit();
