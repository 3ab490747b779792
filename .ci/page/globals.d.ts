// What the page leaves at the window, for its tests.
interface Window {
  robactorReport: any;
  robactorView: any;
}
