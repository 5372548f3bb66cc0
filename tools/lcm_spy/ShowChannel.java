import java.awt.Component;
import java.awt.Container;
import java.awt.Graphics2D;
import java.awt.Point;
import java.awt.Rectangle;
import java.awt.Robot;
import java.awt.Window;
import java.awt.event.MouseEvent;
import java.io.ByteArrayOutputStream;
import java.io.File;
import java.io.IOException;
import java.io.PrintStream;
import java.io.UncheckedIOException;
import java.util.Arrays;
import java.util.Map;
import java.util.TreeMap;
import java.util.concurrent.Callable;
import java.util.concurrent.FutureTask;
import java.util.concurrent.TimeoutException;
import javax.imageio.ImageIO;
import javax.swing.JFrame;
import javax.swing.JTable;
import javax.swing.SwingUtilities;
import info.monitorenter.gui.chart.Chart2D;
import lcm.spy.ObjectPanel;
import org.apache.xmlgraphics.java2d.GraphicContext;
import org.apache.xmlgraphics.java2d.ps.EPSDocumentGraphics2D;
import org.apache.xmlgraphics.java2d.ps.PSTextHandler;

/**
 * lcm-spy with one channel open: waits for a message, double-clicks the channel's row, saves a picture of the screen and
 * prints the list of channels and what the spy paints in the channel's window, line by line. For the documentation and for tests.
 *
 * <p>Arguments: channel; field whose curve is opened too, or an empty text; PNG file; and what lcm-spy itself takes.
 */
public final class ShowChannel {
  private static final long PATIENCE_MS = 60_000;
  private static final int LIST_WIDTH_PX = 700, LIST_HEIGHT_PX = 360, VIEW_WIDTH_PX = 620, HEIGHT_PX = 1000, GAP_PX = 10;
  private static final int WHOLE_MESSAGE_PX = 10_000;  // more than any of our messages needs

  public static void main(String[] arguments) {
    PrintStream out = System.out;
    System.setOut(System.err);  // lcm-spy is talkative
    int code = 1;
    try {
      out.print(show(arguments));
      out.flush();
      code = 0;
    } catch (TimeoutException | IOException inVain) {
      System.err.println("tools/spy: " + inVain.getMessage());
    } catch (Throwable error) {
      error.printStackTrace();
    }
    Runtime.getRuntime().halt(code);  // the spy's threads know no end
  }

  private static String show(String[] arguments) throws Exception {
    String channel = arguments[0];
    String curve = arguments[1];
    lcm.spy.Spy.main(Arrays.copyOfRange(arguments, 3, arguments.length));
    JTable table = await("lcm-spy's table of channels", () -> find(JTable.class));
    int row = await("a message on " + channel, () -> rowOf(table, channel));
    onEventThread(() -> { click(table, table.getCellRect(row, 0, false).getLocation(), 2); return true; });
    ObjectPanel panel = await("the window of " + channel, () -> find(ObjectPanel.class));
    onEventThread(() -> { arrange(table, panel); return true; });
    await("a rate of " + channel, () -> number(table, row, "Num") > 100 && number(table, row, "Hz") > 1 ? true : null);
    if (!curve.isEmpty()) {
      onEventThread(() -> { openCurve(panel, curve); return true; });
      JFrame chart = await("the chart of " + curve, () -> frameOf(Chart2D.class));
      onEventThread(() -> { chart.setBounds(0, LIST_HEIGHT_PX + GAP_PX, LIST_WIDTH_PX, HEIGHT_PX - LIST_HEIGHT_PX - GAP_PX); return true; });
      Thread.sleep(4000);  // until the chart has something to show
    }
    Thread.sleep(500);  // the spy paints when it likes
    Rectangle screen = new Rectangle(0, 0, LIST_WIDTH_PX + GAP_PX + VIEW_WIDTH_PX, HEIGHT_PX);
    ImageIO.write(new Robot().createScreenCapture(screen), "png", new File(arguments[2]));
    return onEventThread(() -> listedText(table) + "\n" + paintedText(panel));
  }

  private static Window window(Component part) { return SwingUtilities.getWindowAncestor(part); }

  private static Integer rowOf(JTable table, String channel) {
    for (int row = 0; row < table.getRowCount(); ++row)
      if (channel.equals(String.valueOf(table.getValueAt(row, 0)))) return row;
    return null;
  }

  private static double number(JTable table, int row, String column) {
    for (int i = 0; i < table.getColumnCount(); ++i)
      if (table.getColumnName(i).trim().startsWith(column)) return Double.parseDouble(table.getValueAt(row, i).toString().trim());
    throw new IllegalStateException("lcm-spy's table has no column " + column);
  }

  private static void click(Component part, Point at, int times) {
    part.dispatchEvent(new MouseEvent(part, MouseEvent.MOUSE_CLICKED, System.currentTimeMillis(), 0, at.x, at.y, times, false,
        MouseEvent.BUTTON1));
  }

  private static void arrange(JTable table, ObjectPanel panel) {
    window(table).setBounds(0, 0, LIST_WIDTH_PX, LIST_HEIGHT_PX);
    window(panel).setBounds(LIST_WIDTH_PX + GAP_PX, 0, VIEW_WIDTH_PX, HEIGHT_PX);
    window(table).validate();
    window(panel).validate();
  }

  /** A click on the small curve at the right end of the line that shows `field`. */
  private static void openCurve(ObjectPanel panel, String field) {
    for (Map.Entry<Integer, TreeMap<Integer, String>> line : paintedLines(panel).entrySet())
      if (line.getValue().containsValue(field)) click(panel, new Point(panel.getWidth() - 40, line.getKey() - 4), 1);
  }

  /** Channel and type of every row. */
  private static String listedText(JTable table) {
    StringBuilder text = new StringBuilder();
    for (int row = 0; row < table.getRowCount(); ++row)
      text.append(table.getValueAt(row, 0)).append('\t').append(table.getValueAt(row, 1)).append('\n');
    return text.toString();
  }

  /** Everything the panel draws as text, one line for every height, from left to right. */
  private static String paintedText(ObjectPanel panel) {
    // It draws only what can be seen.
    window(panel).setSize(VIEW_WIDTH_PX, WHOLE_MESSAGE_PX);
    window(panel).validate();
    StringBuilder text = new StringBuilder();
    for (TreeMap<Integer, String> line : paintedLines(panel).values())
      text.append(String.join("\t", line.values()).strip()).append('\n');
    return text.toString();
  }

  private static TreeMap<Integer, TreeMap<Integer, String>> paintedLines(ObjectPanel panel) {
    TreeMap<Integer, TreeMap<Integer, String>> lines = new TreeMap<>();
    EPSDocumentGraphics2D paper = new EPSDocumentGraphics2D(false);
    paper.setGraphicContext(new GraphicContext());
    try {
      paper.setupDocument(new ByteArrayOutputStream(), panel.getWidth(), panel.getHeight());
    } catch (IOException impossible) {
      throw new UncheckedIOException(impossible);
    }
    paper.setCustomTextHandler(new PSTextHandler() {
      @Override public void writeSetup() {}
      @Override public void writePageSetup() {}
      @Override public void drawString(Graphics2D to, String text, float x, float y) {
        lines.computeIfAbsent(Math.round(y), height -> new TreeMap<>()).put(Math.round(x), text);
      }
    });
    panel.paint(paper);
    return lines;
  }

  private static JFrame frameOf(Class<?> kind) {
    for (Window window : Window.getWindows())
      if (window instanceof JFrame && window.isShowing() && find(kind, window) != null) return (JFrame) window;
    return null;
  }

  private static <T> T find(Class<T> kind) {
    JFrame frame = frameOf(kind);
    return frame == null ? null : find(kind, frame);
  }

  private static <T> T find(Class<T> kind, Container inside) {
    for (Component part : inside.getComponents()) {
      if (kind.isInstance(part)) return kind.cast(part);
      T found = part instanceof Container ? find(kind, (Container) part) : null;
      if (found != null) return found;
    }
    return null;
  }

  /** The first answer of `ask` that is not null. */
  private static <T> T await(String what, Callable<T> ask) throws Exception {
    for (long end = System.currentTimeMillis() + PATIENCE_MS; System.currentTimeMillis() < end; Thread.sleep(50)) {
      T answer = onEventThread(ask);
      if (answer != null) return answer;
    }
    throw new TimeoutException("waited " + PATIENCE_MS / 1000 + " s for " + what);
  }

  private static <T> T onEventThread(Callable<T> ask) throws Exception {
    FutureTask<T> task = new FutureTask<>(ask);
    SwingUtilities.invokeAndWait(task);
    return task.get();
  }
}
