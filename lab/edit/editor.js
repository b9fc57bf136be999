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

// A draft outlives a reload and a server that was started again.
function keepDraft(key) {
  return CM.EditorView.updateListener.of((update) => {
    if (update.docChanged) sessionStorage.setItem(key, update.state.doc.toString());
    if (update.selectionSet || update.docChanged) {
      const line = update.state.doc.lineAt(update.state.selection.main.head).number;
      if (line !== keepDraft.line) emitEvent("gd-line", (keepDraft.line = line));
    }
  });
}

window.genDataEdit = {
  async attach(id, tab, key) {
    const editor = await getElement(id).editorPromise;
    const source = completions(tab);
    editor.dispatch({
      effects: CM.StateEffect.appendConfig.of([
        CM.EditorState.languageData.of(() => [{ autocomplete: source }]),
        explanation(tab),
        keepDraft(key),
        CM.EditorView.contentAttributes.of({ "aria-label": "Configuration in YAML" }),
      ]),
    });
    return sessionStorage.getItem(key);
  },
  forget(key) {
    sessionStorage.removeItem(key);
  },
};
window.dispatchEvent(new Event("gd-ready"));
