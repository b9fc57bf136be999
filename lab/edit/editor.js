// Help in the YAML editor: completions, explanations and drafts. Answers come from the server of
// the page; texts are inserted as text, never as HTML.
import * as CM from "nicegui-codemirror";

// Python counts characters, JavaScript UTF-16 units.
const toCharacters = (text, unit) => [...text.slice(0, unit)].length;
const toUnits = (text, count) => [...text].slice(0, count).join("").length;

async function ask(what, tab, text, unit) {
  const reply = await fetch(`/edit/${what}`, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ tab, text, offset: toCharacters(text, unit) }),
  });
  return reply.ok ? reply.json() : null;
}

function completions(tab) {
  return async (context) => {
    const word = context.matchBefore(/[\w./$-]*/);
    const before = context.state.sliceDoc(context.pos - 2, context.pos);
    if (!context.explicit && !word.text && !/(: |- |[{[,] ?)$/.test(before)) return null;
    const text = context.state.doc.toString();
    const reply = await ask("complete", tab, text, context.pos);
    if (!reply || context.aborted || !reply.proposals.length) return null;
    return {
      from: toUnits(text, reply.start),
      validFor: /^[\w./$-]*$/,
      options: reply.proposals.map((one) => ({
        label: one.label,
        apply: one.insert,
        type: one.kind,
        detail: one.detail,
        info: one.info || undefined,
      })),
    };
  };
}

// Faults are marks of the browser: a property of the server's element would also send its text,
// which is older than the latest keys.
const setFaults = CM.StateEffect.define();
const faults = CM.StateField.define({
  create: () => CM.Decoration.none,
  update(marks, transaction) {
    marks = marks.map(transaction.changes);
    for (const effect of transaction.effects)
      if (effect.is(setFaults)) marks = markAll(transaction.state.doc, effect.value);
    return marks;
  },
  provide: (field) => CM.EditorView.decorations.from(field),
});

function markAll(doc, listed) {
  const ranges = [];
  for (const fault of listed.filter((one) => one.line >= 1 && one.line <= doc.lines)) {
    const line = doc.line(fault.line);
    ranges.push(CM.Decoration.line({ class: "gd-wrong-line" }).range(line.from));
    const from = line.from + toUnits(line.text, fault.column - 1);
    const word = /^.[^ ,:{}[\]#]*/.exec(doc.sliceString(from, line.to));
    const mark = CM.Decoration.mark({ class: "gd-wrong", attributes: { title: fault.text } });
    if (word) ranges.push(mark.range(from, from + word[0].length));
  }
  return CM.Decoration.set(ranges, true);
}

function explanation(tab) {
  return CM.hoverTooltip(async (view, unit) => {
    const reply = await ask("explain", tab, view.state.doc.toString(), unit);
    if (!reply || !reply.text) return null;
    return {
      pos: unit,
      above: true,
      create() {
        const dom = document.createElement("div");
        dom.className = "gd-help";
        const name = dom.appendChild(document.createElement("strong"));
        name.textContent = reply.name;
        dom.appendChild(document.createElement("div")).textContent = reply.text;
        return { dom };
      },
    };
  });
}

// A draft survives a reload and a restart of the server.
function keepDraft(key) {
  return CM.EditorView.updateListener.of((update) => {
    if (update.docChanged) sessionStorage.setItem(key, update.state.doc.toString());
    if (update.selectionSet || update.docChanged) {
      const line = update.state.doc.lineAt(update.state.selection.main.head).number;
      if (line !== keepDraft.line) emitEvent("gd-line", (keepDraft.line = line));
    }
  });
}

// The colours of CodeMirror's own style, mixed with white in the dark by editor.css: the themes of
// the package have less contrast than WCAG requires.
const colors = CM.HighlightStyle.define(
  CM.defaultHighlightStyle.specs.map((spec) =>
    spec.color ? { ...spec, color: `color-mix(in srgb, ${spec.color} var(--gd-own), white)` } : spec,
  ),
);

window.genDataEdit = {
  async attach(id, tab, key) {
    const editor = await getElement(id).editorPromise;
    const source = completions(tab);
    editor.dispatch({
      effects: getElement(id).themeConfig.reconfigure(CM.syntaxHighlighting(colors)),
    });
    editor.dispatch({
      effects: CM.StateEffect.appendConfig.of([
        CM.EditorState.languageData.of(() => [{ autocomplete: source }]),
        faults,
        explanation(tab),
        keepDraft(key),
        CM.EditorView.contentAttributes.of({ "aria-label": "Configuration in YAML" }),
      ]),
    });
    return sessionStorage.getItem(key);
  },
  async mark(id, listed) {
    const editor = await getElement(id).editorPromise;
    editor.dispatch({ effects: setFaults.of(listed) });
  },
  forget(key) {
    sessionStorage.removeItem(key);
  },
};
window.dispatchEvent(new Event("gd-ready"));
