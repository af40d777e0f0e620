// What the page tells: a message to read, sentences for those who hear it.

const $ = id => document.getElementById(id);

let silence;
export function say(text, bad = false, button = null) {
  const node = $("message");
  // Beside an open dialog nothing can be read or pressed.
  (document.querySelector("dialog[open]") ?? document.body).append(node);
  node.textContent = text;
  node.classList.toggle("bad", bad);
  node.classList.toggle("on", Boolean(text));
  if (button) {
    const press = document.createElement("button");
    press.textContent = button.text;
    press.onclick = button.act;
    node.append(" ", press);
  }
  clearTimeout(silence);
  if (text && !button) silence = setTimeout(() => say(""), Math.max(bad ? 9000 : 4000, 60 * text.length));
}

// For those who hear the page: what is told in one moment is said together.
const sentences = [];
export function speak(text) {
  if (!sentences.length) setTimeout(() => { $("spoken").textContent = sentences.splice(0).join(". "); }, 60);
  if (!sentences.includes(text)) sentences.push(text);
}
