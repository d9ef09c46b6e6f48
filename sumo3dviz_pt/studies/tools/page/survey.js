// Plays the films of a trial within LimeSurvey, Qualtrics and oTree: one after the other, and no
// answer before they have ended. `STUDY` stands above, with the playlists; oTree's pages have links
// to the films of their trial instead.
"use strict";

(() => {
  const { words } = STUDY;
  const QUESTION = ".question-container, .QuestionOuter, .question";
  const NEXT = "#ls-button-submit, #NextButton, #next-button, .otree-btn-next";

  /** Who sees what: the survey's own variable, the address, what was drawn here before, or chance. */
  const playlistOf = (element) => {
    const names = Object.keys(STUDY.playlists);
    const asked = new URLSearchParams(location.search).get("playlist");
    const key = `films:${STUDY.digest}`;
    const wanted = [element.dataset.playlist, asked, sessionStorage.getItem(key)];
    const name = wanted.find((each) => names.includes(each))
      ?? names[Math.floor(Math.random() * names.length)];
    sessionStorage.setItem(key, name);
    window.Qualtrics?.SurveyEngine.setEmbeddedData("playlist", name);
    return name;
  };

  const paragraph = (place, tag, words) => {
    const element = document.createElement(tag);
    element.textContent = words;
    if (words) place.append(element);
    return element;
  };

  /** A film from beginning to end; if it cannot be shown, it is tried again or left out. */
  const played = (place, { address, letter, told }) => new Promise((done) => {
    place.replaceChildren();
    paragraph(place, "h2", letter);
    const video = document.createElement("video");
    Object.assign(video, { muted: !STUDY.heard, playsInline: true, preload: "auto", src: address });
    video.setAttribute("playsinline", "");
    video.style.cssText = "display: block; margin: auto; max-height: 70vh; max-width: 100%";
    place.append(video);
    paragraph(place, "p", told);
    const button = (words, act) => {
      const element = paragraph(place, "button", words);
      element.type = "button";
      element.style.cssText = "margin: 4px; min-height: 44px; min-width: 44px";
      element.addEventListener("click", act);
      return element;
    };
    video.addEventListener("ended", () => done(true));
    video.addEventListener("error", () => {
      video.remove();
      paragraph(place, "p", words.problem);
      button(words.retry, () => played(place, { address, letter, told }).then(done));
      button(words.skip, () => done(false));
    });
    const start = () => video.play().catch((error) => {
      if (error.name !== "NotAllowedError") return;  // an error event says the others
      const element = button(words.play, () => {
        element.remove();
        start();
      });
    });
    start();
  });

  /** Questions whose films have not ended: their answers and the way on are closed. */
  const closed = new Set();
  const shut = (question, isShut) => {
    const answers = question.querySelectorAll("input, select, textarea");
    for (const part of [...answers, ...document.querySelectorAll(NEXT)]) {
      if (part.disabled !== isShut) part.disabled = isShut;
    }
  };

  const filmsOf = (element) => {
    const links = [...element.querySelectorAll("a.film")];
    if (!STUDY.playlists) return links.map(({ href, dataset }) => ({ address: href, ...dataset }));
    return STUDY.playlists[playlistOf(element)][Number(element.dataset.position) - 1];
  };

  const show = async (element) => {
    const films = filmsOf(element);
    const question = element.closest(QUESTION) ?? element.parentElement;
    element.dataset.shown = "1";
    if (!films) {  // this playlist is shorter
      question.style.display = "none";
      document.querySelector(NEXT)?.click();
      return;
    }
    closed.add(question);
    shut(question, true);
    for (const film of films) if (film.address) await played(element, film);
    const last = films.filter((film) => film.told && films.length > 1);
    for (const { letter, told } of last) paragraph(element, "p", `${letter}: ${told}`);
    element.dataset.ended = "1";
    closed.delete(question);
    shut(question, false);
  };

  const look = () => {
    for (const question of closed) shut(question, true);
    for (const element of document.querySelectorAll(".films[data-position]:not([data-shown])")) {
      show(element);
    }
  };
  // Answers come after this script, and pages without the document being loaded anew.
  new MutationObserver(look).observe(document.documentElement, {
    childList: true, subtree: true, attributeFilter: ["disabled"],
  });
  look();
})();
