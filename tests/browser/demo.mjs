// node demo.mjs PROGRAM SEED…: opens the demo's page as a stranger does, and does only what its largest words say, until they say
// that nothing is missing or 60 s are over. Prints for each seed what was hidden, what was added, and the time from opening to adding.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { launch, open } from './browser.mjs';

const [program, ...seeds] = process.argv.slice(2);
const LIMIT = 60;
const browser = await launch();
let right = 0;
for (const seed of seeds) {
  const folder = mkdtempSync('/tmp/trd-');
  const demo = spawn(program, ['demo', '--seed', seed], { env: { ...process.env, TRUERATE_RUNTIME_DIR: folder }, stdio: ['ignore', 'pipe', 'pipe'] });
  let said = '';
  const ended = new Promise(done => demo.on('exit', done));
  const url = await new Promise(done => {
    for (const stream of [demo.stdout, demo.stderr]) stream.on('data', text => { said += text; const found = said.match(/^dashboard: (http\S+)/m); if (found) done(found[1]); });
  });
  const { context, page } = await open(browser, url);
  await page.goto(url);
  const opened = Date.now(), seconds = () => (Date.now() - opened) / 1000;
  const added = [];
  while (seconds() < LIMIT) {
    const says = await page.locator('#verdict').innerText();
    const button = page.locator('#verdict button.primary:enabled');
    if (await button.count()) {
      const effect = await button.getAttribute('data-effect');
      // It is gone where the page changed its mind meanwhile.
      if (await button.click({ timeout: 1000 }).then(() => true, () => false)) added.push([effect, seconds()]);
      await page.waitForTimeout(2000);
    } else if (added.length && /^(Nothing|No effect) is missing/m.test(says)) break;
    await page.waitForTimeout(200);
  }
  const model = await page.locator('#model .chip:not(.fixed)').evaluateAll(chips => chips.map(chip => chip.dataset.effect));
  const last = await page.locator('#verdict h2').innerText();
  const told = (await page.locator('#verdict').innerText()).match(/^Hidden was: .*$/m)?.[0] ?? 'not told what was hidden';
  await context.close();
  demo.kill('SIGINT');
  await ended;
  rmSync(folder, { recursive: true, force: true });
  const hidden = (said.match(/^hidden: (.*)$/m)?.[1] ?? '').split(', ').map(text => text.split(':')[0]);
  const isRight = hidden.every(id => model.includes(id)) && model.length === hidden.length;
  right += isRight;
  console.log(`${seed}\t${isRight ? 'right' : 'WRONG'}\thidden ${hidden}\tin the model ${model.join()}\tpressed ${added.map(([id, at]) => `${id} at ${at.toFixed(0)} s`).join(', ')}\t${last}\t${told}`);
}
await browser.close();
console.log(`${right} of ${seeds.length}`);
