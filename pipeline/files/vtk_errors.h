/// VTK prints its errors and goes on; this collects them so that they can be thrown. Inside vtk_files.cpp only.
#pragma once

#include <vtkCommand.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

#include <string>

namespace mbtfm::files {

/// Takes the place of VTK's output window while it lives and keeps what VTK says.
class VtkErrors {
 public:
  VtkErrors() : before_(vtkOutputWindow::GetInstance()) { vtkOutputWindow::SetInstance(window_); }
  ~VtkErrors() { vtkOutputWindow::SetInstance(before_); }
  VtkErrors(const VtkErrors&) = delete;
  VtkErrors& operator=(const VtkErrors&) = delete;
  std::string text() const { return window_->text; }

 private:
  class Window : public vtkOutputWindow {
   public:
    static Window* New();
    vtkTypeMacro(Window, vtkOutputWindow);
    void DisplayText(const char* message) override { text += message; }
    void DisplayWarningText(const char*) override {}
    std::string text = {};
  };
  vtkNew<Window> window_;
  vtkSmartPointer<vtkOutputWindow> before_;
};

inline VtkErrors::Window* VtkErrors::Window::New() { VTK_STANDARD_NEW_BODY(VtkErrors::Window); }

}  // namespace mbtfm::files
