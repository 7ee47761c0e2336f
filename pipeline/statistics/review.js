// The page of a review: one cell at a time, decisions kept by the browser, review.csv for the folder of the study.
const cells = [...document.querySelectorAll("article")], study = document.body.querySelector("[data-study]").dataset.study;
const store = "mbtfm review " + study, decided = JSON.parse(localStorage.getItem(store) || "{}");
let at = 0;
const nameOf = cell => cell.dataset.cell, of = cell => decided[nameOf(cell)] ||= {};
const boxesIn = cell => [...cell.querySelectorAll("input[type=checkbox]")];
const isOfNow = cell => !of(cell).segmentation || of(cell).segmentation === cell.dataset.segmentation;
const wordOf = cell => of(cell).verdict || "";
for (const cell of cells) {
  const was = of(cell);
  if (!isOfNow(cell)) was.fibres = undefined;  // numbers of other fibres
  was.segmentation = cell.dataset.segmentation;
  was.verdict ??= cell.dataset.verdict;
  was.note ??= cell.dataset.note;
  was.fibres ??= boxesIn(cell).filter(box => box.checked).map(box => box.value);
  boxesIn(cell).forEach(box => {
    box.checked = was.fibres.includes(box.value);
    box.onchange = () => { was.fibres = boxesIn(cell).filter(b => b.checked).map(b => b.value); keep(); };
  });
  const note = cell.querySelector("input[type=text]");
  note.value = was.note;
  note.oninput = () => { was.note = note.value; keep(); };
  cell.querySelectorAll("button[data-verdict]").forEach(button => button.onclick = () => decide(button.dataset.verdict));
  cell.querySelector(".copy").onclick = () => navigator.clipboard.writeText(cell.querySelector("code").textContent);
}
function keep() {
  localStorage.setItem(store, JSON.stringify(decided));
  show(at);
}
function show(index) {
  at = Math.min(Math.max(index, 0), cells.length - 1);
  cells.forEach((cell, k) => cell.hidden = k !== at);
  const cell = cells[at], n = cells.filter(wordOf).length;
  cell.querySelectorAll("button[data-verdict]").forEach(b => b.setAttribute("aria-pressed", b.dataset.verdict === wordOf(cell)));
  document.getElementById("where").textContent = `cell ${at + 1} of ${cells.length}; ${n} decided`;
}
function decide(verdict) {
  of(cells[at]).verdict = verdict;
  keep();
  show(at + 1);
}
document.getElementById("previous").onclick = () => show(at - 1);
document.getElementById("next").onclick = () => show(at + 1);
document.addEventListener("keydown", event => {
  if (event.target.matches?.("input[type=text]") || event.ctrlKey || event.metaKey || event.altKey) return;
  const act = {a: () => decide("accepted"), x: () => decide("left out"), n: () => show(at + 1), p: () => show(at - 1),
               ArrowRight: () => show(at + 1), ArrowLeft: () => show(at - 1)}[event.key];
  if (act) { act(); event.preventDefault(); }
});
document.getElementById("save").onclick = () => {
  const quoted = text => '"' + String(text).replaceAll('"', '""') + '"';
  const rows = [["cell", "fibre_id", "verdict", "note", "segmentation"]];
  for (const cell of cells) {
    const {verdict, note, fibres, segmentation} = of(cell);
    if (verdict || note) rows.push([nameOf(cell), "", verdict, note, segmentation]);
    for (const fibre of fibres) rows.push([nameOf(cell), fibre, "left out", "", segmentation]);
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([rows.map(row => row.map(quoted).join(",") + "\n").join("")], {type: "text/csv"}));
  link.download = "review.csv";
  link.click();
};
show(0);
