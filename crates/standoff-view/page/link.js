// Links to a time and a selection: `#t=100&uav=2`, `#t=40&target=car%203&follow=1`.

/** Longest name that stands in a link. */
const LONGEST_NAME = 100;

/** What a link may say. */
const KEYS = ["t", "run", "picture", "uav", "group", "target", "intruder", "follow"];

class Link {
  constructor(page) {
    this.page = page;
    window.addEventListener("hashchange", () => this.open());
    element("link").addEventListener("click", () => this.copy());
  }

  /** Goes where the address says, and tells of what in it cannot be. */
  open() {
    const { page } = this;
    const asked = new URLSearchParams(location.hash.slice(1));
    const told = [...asked].filter(([key, value], k, all) => value && (!KEYS.includes(key) || all.findIndex(([other]) => other === key) < k))
      .map(([key]) => `says ${short(key)}, which is not known here, or twice`);
    const run = page.runs.find(({ letter }) => page.pair && letter.toLowerCase() === asked.get("run"));
    if (run) page.show(run);
    const picture = this.picture(asked, told);
    if (picture !== page.film.minds.chosen) page.choosePicture(picture);
    if (asked.has("t")) this.seek(asked.get("t"), told);
    const object = this.object(asked, told);
    if (object) page.choice.choose(object);
    if (object && asked.get("follow") === "1") page.choice.follow(object);
    page.timeline.say(told.length ? `The link ${told.join("; it ")}.` : "");
  }

  seek(text, told) {
    const { clock } = this.page;
    const { film } = clock;
    const time_s = /^-?\d+(\.\d+)?$/.test(text) ? Number(text) : NaN;
    if (Number.isNaN(time_s)) {
      told.push(`says t=${short(text)}: that is no number of seconds`);
      return;
    }
    const [first_s, last_s] = [film.times_s[0], film.end_s];
    clock.pause();
    clock.seek(time_s);
    if (time_s >= first_s && time_s <= last_s) return;
    const range = `${clock.done ? "the run is" : "what has been flown is"} from ${first_s.toFixed(1)} to ${last_s.toFixed(1)} s`;
    told.push(`asks for ${short(text)} s, and ${range}: this is the nearest`);
  }

  /** The UAV whose picture the address asks for; `null`, if for none that there is. */
  picture(asked, told) {
    if (!asked.has("picture")) return null;
    const text = asked.get("picture");
    const { minds } = this.page.film;
    const uav = minds.ids.find((id) => String(id) === text);
    if (uav === undefined) {
      const why = minds.isSeveral ? "which this run does not have" : "and in this run one mind thinks for all";
      told.push(`asks for the picture of UAV ${short(text) || "(nothing)"}, ${why}`);
    }
    return uav ?? null;
  }

  /** The first object that the address names, if there is one in this run. */
  object(asked, told) {
    const { film } = this.page;
    for (const kind of ["uav", "group", "target", "intruder"]) {
      if (!asked.has(kind)) continue;
      const text = asked.get(kind);
      const id = kind === "target" ? targetOf(film, text) : film.ids[`${kind}s`].find((id) => String(id) === text);
      if (id !== undefined) return { kind, id };
      told.push(`names ${kind === "uav" ? "UAV" : kind} ${short(text) || "(nothing)"}, which this run does not have`);
    }
    return null;
  }

  /** The address of what is shown. */
  get hash() {
    const { clock, choice, film } = this.page;
    const object = [choice.object, choice.followed].find((one) => one?.id !== undefined);
    const asked = new URLSearchParams({ t: String(Number(clock.time_s.toFixed(3))) });
    if (this.page.pair) asked.set("run", this.page.run.letter.toLowerCase());
    if (film.minds.chosen !== null) asked.set("picture", film.minds.chosen);
    if (object) asked.set(object.kind, object.kind === "target" ? targetWord(film, object.id) : object.id);
    if (object && objectWord(object) === objectWord(choice.followed)) asked.set("follow", "1");
    return `#${asked}`;
  }

  /** Puts the link into the address bar, and where it can be pasted from. */
  async copy() {
    const { timeline } = this.page;
    const href = location.href.replace(/#.*$/, "") + this.hash;
    try {
      history.replaceState(null, "", href);
    } catch {
      // Some browsers hold on to the address of a page.
    }
    try {
      await navigator.clipboard.writeText(href);
      timeline.say(`Copied: ${this.hash}`);
    } catch {
      timeline.say(location.href === href ? "The link is in the address bar" : `Add this to the page's address: ${this.hash}`);
    }
  }
}

/** The target of a word: of this name, or else of this id. */
function targetOf({ head }, word) {
  const id = head.targets.indexOf(word);
  if (id >= 0) return id;
  return /^\d+$/.test(word) && Number(word) < head.targets.length ? Number(word) : undefined;
}

/** A word for a target: its name, unless that is another's, too, or long. */
function targetWord(film, id) {
  const name = film.head.targets[id] ?? "";
  return name.length <= LONGEST_NAME && targetOf(film, name) === id ? name : String(id);
}
