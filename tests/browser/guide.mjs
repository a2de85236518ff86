// node guide.mjs URL: the page of a recording that a simulated hand follows, up to its end.
import { check, finish, launch, looks, open, until } from './browser.mjs';

const [url] = process.argv.slice(2);
const browser = await launch();
const { page, notes } = await open(browser, url);
await page.goto(url);
const now = () => page.locator('#now').innerText();
await until('an order', 60, async () => /^(Hold|Turn)/.test(await now()));
// The order is what is read first: no words are larger.
// In one step: the page may draw itself anew at any time, and what was drawn before has no style.
const size = place => page.evaluate(place => parseFloat(getComputedStyle(document.querySelector(place)).fontSize), place);
check(await size('#now') > 1.4 * await size('h1'), 'the order is not the largest on the page');
await until('a manoeuvre that is followed', 120, async () => (await page.locator('.hand').innerText()).startsWith('good: '));
const rows = page.locator('.goals tbody tr');
check(await rows.count() >= 3, `${await rows.count()} parameters`);
check(/%|enough/.test(await rows.first().innerText()), `a parameter reads ${await rows.first().innerText()}`);
await looks(page, 'guide');
notes.troubled = true;
await until('the result', 240, async () => /^Done/.test(await now()));
check(/truerate ladder/.test(await page.locator('#end .command code').innerText()), 'no command to run next');
check((await page.locator('#link').innerText()) === 'the recording has ended', 'it does not say that it has ended');
await browser.close();
finish();
