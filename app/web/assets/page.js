// The page of dearig watch. It sends nothing: it reads one stream, and draws it. All texts of the
// stream come from files of others, so that they are set as text and never as markup.
"use strict";

const STALE_S = 2;        // eight flushes of a recording
const LOST_MS = 4000;     // the server says something every second
const PLOT_HEIGHT = 170;

const byId = (id) => document.getElementById(id);
const body = document.body;
let state = null;         // the newest state of the stream
let heard = 0;            // performance.now() of the newest message
let age = null;           // age in s of the newest sample at that time
let span = "recent";
let plots = [];           // {chart, box} as they are drawn
let layout = "";          // what the plots were made for
let shift = null;         // recording time in s minus the clock of the page
let fresh = false;        // a state came since the plots were drawn
let stream = null;

// ------------------------------------------------------------------ texts

function put(id, text) {
  const at = byId(id);
  if (at.textContent !== text) at.textContent = text;
}

function show(id, visible) {
  byId(id).hidden = !visible;
}

function made(kind, name, text) {
  const element = document.createElement(kind);
  if (name) element.className = name;
  if (text !== undefined) element.textContent = text;
  return element;
}

function badge(id, text, kind) {
  put(id, text);
  byId(id).className = `badge ${kind}`;
}

function ago(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.round(seconds)} s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

function clockText(seconds) {
  if (seconds < 600) return `${seconds.toFixed(1)} s`;
  const minutes = Math.floor(seconds / 60);
  if (minutes < 60) return `${minutes} min ${Math.floor(seconds % 60)} s`;
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

// ------------------------------------------------------------------ campaign and recording

const CAMPAIGN = {
  running: "ok", paused: "warn", complete: "off", ended: "off", armed_runs: "warn",
  armed_time: "warn", interrupted: "warn", refused: "bad", band: "bad", halted: "bad", killed: "bad",
};

function showState() {
  const { campaign, recording } = state;
  const title = campaign ? campaign.name : recording ? recording.name : state.source || "dearig watch";
  put("title", title);
  document.title = `${state.alarms && state.alarms.length ? "(!) " : ""}${title} - dearig watch`;
  put("subtitle", campaign ? `${campaign.rig}, folder ${state.source}` : state.source || "");
  show("simulated", Boolean(recording && recording.simulated));
  showStatus();
  const alarms = state.alarms || [];
  const box = byId("alarms");
  if (box.dataset.shown !== JSON.stringify(alarms)) {
    box.dataset.shown = JSON.stringify(alarms);
    box.replaceChildren(...alarms.map((text) => made("p", "notice bad", text)));
  }
  const trouble = state.trouble || (recording && recording.trouble) || "";
  put("trouble", trouble);
  show("trouble", trouble !== "");
  show("campaign", Boolean(campaign));
  if (campaign) showCampaign(campaign);
  show("recording", Boolean(recording && recording.channels.length));
  if (recording) showRecording(recording);
}

function showStatus() {
  const { campaign, recording } = state;
  let text = "", kind = "off";
  if (campaign) {
    [text, kind] = [campaign.status.replace("_", " "), CAMPAIGN[campaign.status] || "off"];
  } else if (recording) {
    text = recording.status;
    kind = { recording: "ok", killed: "bad" }[text] || "off";
    if (text === "ended" && recording.outcome && recording.outcome !== "finished") {
      kind = recording.outcome.startsWith("interrupted") ? "warn" : "bad";
      text = recording.outcome.split(":")[0];
    }
  }
  badge("status", text.toUpperCase(), kind);
  show("status", text !== "");
}

function showCampaign(campaign) {
  put("campaign-name", `Campaign ${campaign.name}`);
  put("campaign-left", campaign.time_left ? `${campaign.time_left} left` : "");
  byId("campaign-part").value = campaign.part;
  put("campaign-summary", campaign.summary.join(" "));
  put("campaign-note", campaign.note);
  const table = byId("campaign-runs"), key = JSON.stringify([campaign.head, campaign.runs]);
  if (table.dataset.shown === key) return;
  table.dataset.shown = key;
  const head = made("tr");
  head.append(...campaign.head.map((name) => made("th", "", name || "Run")));
  table.tHead.replaceChildren(head);
  table.tBodies[0].replaceChildren(...campaign.runs.map((run) => {
    const row = made("tr", run.mark ? "bad" : run.muted ? "muted" : "");
    row.append(...run.cells.map((cell) => made("td", "", cell)));
    if (run.detail) row.children[1].append(made("div", "detail", run.detail));
    return row;
  }));
}

function showRecording(recording) {
  put("recording-name", recording.name);
  const time = clockText(recording.time_s), duration = clockText(recording.duration_s);
  put("recording-time", recording.status === "recording" ? `${time} of ${duration}` :
    `${time}, ${recording.samples} samples`);
  byId("recording-part").value = recording.duration_s ? recording.time_s / recording.duration_s : 0;
  const box = byId("values");
  while (box.children.length > recording.channels.length) box.lastChild.remove();
  recording.channels.forEach((channel, i) => {
    if (!box.children[i]) {
      const card = made("div", "value"), line = made("div");
      line.append(made("span", "number"), " ", made("span", "unit"));
      card.append(made("div", "name"), line, made("div", "peak"));
      box.append(card);
    }
    const [name, line, peak] = box.children[i].children;
    name.textContent = channel.label;
    line.children[0].textContent = channel.value.replace("-", "\u2212");
    line.children[1].textContent = channel.unit;
    peak.textContent = `peak ${channel.peak.replace("-", "\u2212")}`;
  });
  const events = byId("events"), key = JSON.stringify(recording.events);
  show("event-part", recording.events.length > 0);
  if (events.dataset.shown !== key) {
    events.dataset.shown = key;
    events.tBodies[0].replaceChildren(...recording.events.toReversed().map((event) => {
      const row = made("tr", ["warning", "fault"].includes(event.level) ? event.level : "");
      row.append(made("td", "", `${event.time_s.toFixed(2)} s`), made("td", "", event.level),
        made("td", "", event.message));
      return row;
    }));
  }
}

function showAge() {
  const now = performance.now(), quiet = now - heard;
  const lost = heard === 0 ? null : quiet > LOST_MS;
  body.classList.toggle("lost", lost === true);
  if (lost === true) badge("connection", `connection lost ${ago(quiet / 1000)} ago`, "bad");
  else badge("connection", heard === 0 ? "connecting" : "connected", heard === 0 ? "off" : "ok");
  const recording = state && state.recording;
  if (!recording || age === null) {
    put("age", "");
    return;
  }
  const seconds = age + quiet / 1000;
  const stale = recording.status !== "recording" || seconds > STALE_S;
  body.classList.toggle("stale", stale);
  let text = `measured ${ago(seconds)} ago`;
  if (recording.status === "ended") text = `Ended ${ago(seconds)} ago: ${recording.outcome || "no reason recorded"}. Not live.`;
  else if (recording.status === "killed") text = `No data for ${ago(seconds)}: the run was killed. Not live.`;
  else if (stale) text = `STALE: no new data for ${ago(seconds)}`;
  put("age", text);
}

// ------------------------------------------------------------------ plots

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

function role(line) {
  return { voltage_command: "command", voltage_monitor: "monitor", displacement_model: "model" }[line.name]
    || "measured";
}

// The ends of the bins as one line: it goes up and down within each bin.
function zigzag(line) {
  const x = [], y = [];
  for (let i = 0; i < line.low.length; i++) {
    const start = line.start + i * line.width, low = line.low[i], high = line.high[i];
    x.push(start, start + line.width / 2);
    // where the signal rises the low end comes first
    const before = i ? line.low[i - 1] : low;
    const falls = low !== null && before !== null && low < before;
    y.push(falls ? high : low, falls ? low : high);
  }
  return [x, y];
}

function data(plot) {
  return uPlot.join(plot.lines.map((line) => zigzag(line[span])));
}

function makePlots(recording) {
  plots.forEach(({ chart }) => chart.destroy());
  const holder = byId("plots");
  holder.replaceChildren();
  plots = recording.plots.map((plot) => {
    const box = made("div", "plot"), head = made("h4"), area = made("div");
    head.append(made("span", "", plot.unit ? `${plot.title} (${plot.unit})` : plot.title));
    if (plot.lines.length > 1) {
      head.append(...plot.lines.map((line) => made("span", `key ${role(line)}`, line.label)));
    }
    box.append(head, area);
    holder.append(box);
    const axis = {
      stroke: colour("muted"), grid: { stroke: colour("line"), width: 0.5 },
      ticks: { stroke: colour("line"), width: 0.5 }, font: "12px system-ui, sans-serif",
    };
    const chart = new uPlot({
      width: Math.max(area.clientWidth, 200), height: PLOT_HEIGHT, legend: { show: false },
      cursor: { drag: { x: false, y: false }, points: { show: false } },
      scales: { x: { time: false, range: () => xRange() } },
      axes: [
        { ...axis, size: 30, values: (_, at) => at.map((t) => `${+t.toFixed(6)} s`), space: 60 },
        { ...axis, size: 56 },
      ],
      series: [{}, ...plot.lines.map((line) => ({
        stroke: colour(role(line)), width: 1, points: { show: false }, spanGaps: true,
      }))],
    }, data(plot), area);
    return { chart, area };
  });
}

// Time of the recording at the right edge: it moves with the clock of the page, not with the data,
// which come four times a second.
function edge(recording) {
  const newest = recording.time_s;
  if (recording.status !== "recording" || shift === null) return newest;
  return Math.min(performance.now() / 1000 + shift, newest + 0.5);
}

function xRange() {
  const recording = state.recording;
  if (span === "whole") {
    return [0, Math.max(recording.status === "recording" ? recording.duration_s : recording.time_s, 1e-3)];
  }
  const end = Math.max(edge(recording), 1e-3);
  return [Math.max(end - recording.recent_s, 0), Math.max(end, Math.min(recording.recent_s, recording.duration_s))];
}

function draw() {
  requestAnimationFrame(draw);
  showAge();
  const recording = state && state.recording;
  if (!recording || !recording.plots.length || document.hidden) return;
  const needed = JSON.stringify([recording.plots.map((p) => [p.title, p.unit, p.lines.map((l) => l.label)])]);
  if (needed !== layout) {
    layout = needed;
    makePlots(recording);
    fresh = true;
  }
  const scrolls = span === "recent" && recording.status === "recording";
  if (!fresh && !scrolls) return;
  plots.forEach(({ chart, area }, i) => {
    if (fresh) {
      if (area.clientWidth && area.clientWidth !== chart.width) {
        chart.setSize({ width: area.clientWidth, height: PLOT_HEIGHT });
      }
      chart.setData(data(recording.plots[i]));
    } else {
      const [min, max] = xRange();
      chart.setScale("x", { min, max });
    }
  });
  fresh = false;
}

function take(message) {
  heard = performance.now();
  age = message.age_s;
  if (!message.state) return;
  const before = state && state.recording;
  state = message.state;
  fresh = true;
  const recording = state.recording;
  if (recording) {
    const target = recording.time_s + (age || 0) - heard / 1000;
    const same = before && before.name === recording.name && shift !== null;
    // small differences are the flushes' rhythm, a large one is another run or one that is not paced
    shift = same && Math.abs(target - shift) < 1 ? shift + 0.1 * (target - shift) : target;
  }
  showState();
}

// ------------------------------------------------------------------ stream

function connect() {
  if (stream !== null) return;
  stream = new EventSource("/live");
  stream.onmessage = (message) => take(JSON.parse(message.data));
  stream.onerror = () => {
    // the browser tries again by itself, unless the server has refused
    if (stream.readyState === EventSource.CLOSED) {
      disconnect();
      setTimeout(connect, 2000);
    }
  };
}

function disconnect() {
  if (stream !== null) stream.close();
  stream = null;
}

function choose(which) {
  span = which;
  for (const name of ["recent", "whole"]) {
    byId(`span-${name}`).setAttribute("aria-pressed", String(name === which));
  }
  fresh = true;
}

byId("span-recent").addEventListener("click", () => choose("recent"));
byId("span-whole").addEventListener("click", () => choose("whole"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { layout = ""; });
window.addEventListener("resize", () => { fresh = true; });
// a browser has few connections to one server: a page that no one sees needs none
document.addEventListener("visibilitychange", () => (document.hidden ? disconnect() : connect()));
connect();
requestAnimationFrame(draw);
