// The page of a probe whose software does not run: loaded anew when what is known changes, and when the probe is back.

const LOOK_MS = 1000;
const told = document.getElementById("told");

async function ask(path) {
  const headers = { "Content-Type": "application/json" };
  const response = await fetch(path, { method: "POST", headers });
  if (!response.ok) {
    const { detail = "It did not work.", remedy = "" } = await response.json().catch(() => ({}));
    throw new Error(`${detail} ${remedy}`);
  }
  return response;
}

function offer(id, words, act) {
  const button = document.getElementById(id);
  button?.addEventListener("click", async () => {
    button.disabled = true;
    told.textContent = "One moment.";
    try {
      await act();
      told.textContent = words;
    } catch (error) {
      told.textContent = error.message;
      button.disabled = false;
    }
  });
}

offer("roll-back", "The probe goes back to its last good release.", () => ask("/api/v1/updates/roll-back"));
offer("support", "The support file is with this browser's downloads.", async () => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await (await ask("/fallback/support")).blob());
  link.download = "tsis-support.zip";
  link.click();
});

async function look() {
  const response = await fetch("/fallback/state", { cache: "no-store" }).catch(() => null);
  const state = response?.ok ? await response.json().catch(() => null) : null;
  // The daemon has no such path: it is back.
  if (response?.status === 404 || (state && state.revision !== document.body.dataset.revision)) location.reload();
}

setInterval(look, LOOK_MS);
