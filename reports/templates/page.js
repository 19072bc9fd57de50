// What every page does: tables that sort, filter and copy; contents that follow; folded parts that open for links and paper.
(() => {
  "use strict";
  document.documentElement.classList.add("js");
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];

  // A cell's number for sorting: what data-value says, else its text.
  const valueOf = (cell) => {
    const text = (cell.dataset.value ?? cell.firstChild?.textContent ?? "").trim();
    const number = Number(text);
    return text !== "" && Number.isFinite(number) ? number : text;
  };
  const inOrder = (a, b, down) => {
    if (a === "" || b === "") return a === b ? 0 : a === "" ? 1 : -1; // empty cells last, whichever way
    const way = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b), "en", { numeric: true });
    return down ? -way : way;
  };

  const sortBy = (table, head, down) => {
    const body = table.tBodies[0], at = head.cellIndex;
    const rows = [...body.rows].map((row, i) => ({ row, i, value: valueOf(row.cells[at]) }));
    rows.sort((a, b) => inOrder(a.value, b.value, down) || a.i - b.i);
    body.append(...rows.map(({ row }) => row));
    all("th", table).forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
  };

  const textOf = (cell) => (cell.querySelector("button") ?? cell).innerText.replace(/[\u2191\u2193]/g, "").replace(/\s*\n\s*/g, " ").trim();
  const headOf = (cell) => cell.dataset.name ?? textOf(cell);
  // a number's interval has columns of its own
  const ownOf = (cell) => (cell.querySelector("small") ? (cell.querySelector("a") ?? cell.firstChild).textContent.trim() : textOf(cell));
  const contentOf = (table) => [
    [...table.tHead.rows[0].cells].map(headOf),
    ...[...table.tBodies[0].rows].filter((row) => !row.hidden).map((row) => [...row.cells].map(ownOf)),
  ];
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
  const tex = (text) => text.replace(/\\/g, "\\textbackslash ").replace(/[&%$#_{}]/g, "\\$&").replace(/~/g, "\\textasciitilde ").replace(/\^/g, "\\textasciicircum ");
  const forms = {
    CSV: (rows) => rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n",
    Markdown: ([head, ...rows]) => {
      const line = (cells) => `| ${cells.map((c) => c.replace(/\|/g, "\\|")).join(" | ")} |`;
      return [line(head), line(head.map(() => "---")), ...rows.map(line)].join("\n") + "\n";
    },
    LaTeX: ([head, ...rows]) => {
      const line = (cells) => `${cells.map(tex).join(" & ")} \\\\`;
      return [`\\begin{tabular}{${"r".repeat(head.length)}}`, "\\hline", line(head), "\\hline", ...rows.map(line), "\\hline", "\\end{tabular}"].join("\n") + "\n";
    },
  };

  const copy = async (text, button) => {
    const before = button.textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch { // a browser that keeps the clipboard from pages of the disk
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    button.textContent = "copied";
    setTimeout(() => { button.textContent = before; }, 1200);
  };

  // What of a wide table lies beyond the edge is said, and a button goes there.
  const hint = (pane, button, table) => {
    const ends = () => [...table.tHead.rows[0].cells].map((head) => head.getBoundingClientRect().right);
    const look = () => {
      const edge = pane.getBoundingClientRect().right + 1, cut = ends().filter((end) => end > edge).length;
      button.hidden = !cut;
      button.textContent = `${cut} more column${cut === 1 ? "" : "s"} \u2192`;
      pane.classList.toggle("cut", cut > 0);
    };
    button.addEventListener("click", () => pane.scrollBy({ left: 0.8 * pane.clientWidth, behavior: "smooth" }));
    pane.addEventListener("scroll", look);
    new ResizeObserver(() => { // it ends between two columns: through one, its numbers lacked digits
      pane.style.maxWidth = "";
      pane.classList.add("cut");
      const left = pane.getBoundingClientRect().left - pane.scrollLeft, whole = ends().map((end) => end - left);
      const room = Math.max(0, ...whole.filter((end) => end <= pane.clientWidth)), frame = pane.offsetWidth - pane.clientWidth;
      if (room && table.offsetWidth > pane.clientWidth + 3) pane.style.maxWidth = `${Math.ceil(room) + frame}px`;
      look();
    }).observe(pane.parentElement);
  };

  for (const box of all("[data-table]")) {
    const table = box.querySelector("table"), count = box.querySelector("output");
    all("thead th", table).forEach((head) => {
      head.querySelector("button")?.addEventListener("click", () => sortBy(table, head, head.getAttribute("aria-sort") === "ascending"));
    });
    const show = () => {
      const words = box.querySelector("input").value.toLowerCase().split(/\s+/).filter(Boolean);
      const only = box.querySelector("select")?.value ?? "";
      let seen = 0;
      for (const row of table.tBodies[0].rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !words.every((word) => text.includes(word)) || (only === "bad" && !row.classList.contains("bad")) || (only === "good" && row.classList.contains("bad"));
        seen += !row.hidden;
      }
      count.textContent = `${seen} of ${table.tBodies[0].rows.length} rows`;
    };
    all("input, select", box).forEach((control) => control.addEventListener("input", show));
    all("button[data-copy]", box).forEach((button) => button.addEventListener("click", () => copy(forms[button.dataset.copy](contentOf(table)), button)));
    show();
    hint(box.querySelector(".scroll"), box.querySelector(".beyond"), table);
  }
  // a case's folder that was copied alone has no page of the run above it
  all("a.up").forEach((link) => { link.hidden = !/\/cases\/[^/]+\/[^/]*$/.test(location.pathname); });
  for (const pane of all(".pan")) { // a figure that is panned on a phone
    const look = () => pane.classList.toggle("cut", pane.scrollLeft + pane.clientWidth < pane.scrollWidth - 2);
    pane.addEventListener("scroll", look);
    new ResizeObserver(look).observe(pane);
  }
  all("button[data-text]").forEach((button) => button.addEventListener("click", () => copy(button.dataset.text, button)));

  const open = () => {
    const aim = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let part = aim && aim.closest("details"); part; part = part.parentElement.closest("details")) part.open = true;
    if (aim) aim.scrollIntoView(); // what was unfolded has made room for it
  };
  addEventListener("hashchange", open);
  open();
  // paper has no folds: all parts open before printing, and go back after
  let folded = [];
  addEventListener("beforeprint", () => { folded = all("details:not([open])"); folded.forEach((part) => { part.open = true; }); });
  addEventListener("afterprint", () => folded.forEach((part) => { part.open = false; }));

  // a page whose template lists no contents gets them from its headings
  const nav = document.querySelector("nav.contents");
  if (!nav.children.length) for (const head of all("main h2[id]")) {
    const link = document.createElement("a");
    link.href = `#${head.id}`;
    link.textContent = head.textContent;
    nav.append(link);
  }
  const links = new Map(all("nav.contents a[href^='#']").map((link) => [link.hash.slice(1), link]));
  const parts = all([...links.keys()].map((id) => `[id="${id}"]`).join() || "nav.nothing"); // as they stand in the page
  const HERE_PX = 80; // a heading that a link went to lies within
  let asked = 0;
  const mark = () => {
    asked = 0;
    const tops = parts.map((part) => part.getBoundingClientRect().top);
    let here = Math.max(0, tops.findLastIndex((top) => top < HERE_PX));
    if (scrollY > 0 && scrollY + innerHeight > document.documentElement.scrollHeight - 2) { // the last parts never reach the top
      const aim = parts.findIndex((part) => `#${part.id}` === location.hash);
      here = aim > here && tops[aim] < innerHeight ? aim : here;
    }
    links.forEach((link) => { link.classList.remove("here"); link.removeAttribute("aria-current"); });
    const link = parts.length && links.get(parts[here].id);
    if (!link) return;
    link.classList.add("here");
    link.setAttribute("aria-current", "true");
    if (nav.scrollWidth > nav.clientWidth) nav.scrollLeft = link.offsetLeft - nav.offsetLeft - nav.clientWidth / 3; // on a phone
  };
  const soon = () => { asked ||= requestAnimationFrame(mark); };
  for (const event of ["scroll", "resize", "hashchange"]) addEventListener(event, soon, { passive: true });
  soon();
})();
